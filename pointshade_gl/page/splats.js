// Trained splats: blended in order before all other things (gpu/clouds/splat_layer.py). A worker puts them in order.

const ROW = 2048; // texels of a row of their textures
const ENTRY = 16, ENTRIES = 64; // texels of an entry of the palette, entries of a row
const DIGIT = 11; // bits of a depth that are sorted at once; two digits
const ANY = 0.004; // of a pixel that splats cover: more is seen
const SHARES = [0.8, 0.2]; // of the normals of cells, and of the plane through the depths beside
const UNLIT = 0.25; // length of a mean normal, below which splats are not lit
const BESIDE = 0.17, WIDEST = 4; // thicknesses between pixels that a map of shadows averages, and most pixels
const FAR_APART = 1e30; // thickness of a surface where sums of half floats cannot tell two of them apart

// Numbers of the splats, the farthest in a direction first. Places are three floats each.
function depthOrder(places, [a, b, c], digit) {
  const count = places.length / 3, keys = new Uint32Array(count), side = 1 << digit;
  const depths = new Float32Array(count);
  let low = Infinity, high = -Infinity;
  for (let k = 0; k < count; ++k) {
    const depth = (depths[k] = a * places[3 * k] + b * places[3 * k + 1] + c * places[3 * k + 2]);
    if (depth < low) low = depth;
    if (depth > high) high = depth;
  }
  const scale = (side * side - 1) / Math.max(high - low, 1e-30);
  for (let k = 0; k < count; ++k) keys[k] = (high - depths[k]) * scale;
  let order = new Int32Array(count);
  for (let k = 0; k < count; ++k) order[k] = k;
  for (const shift of [0, digit]) {
    const starts = new Uint32Array(side + 1), next = new Int32Array(count);
    for (let k = 0; k < count; ++k) ++starts[((keys[k] >>> shift) & (side - 1)) + 1];
    for (let k = 0; k < side; ++k) starts[k + 1] += starts[k];
    for (let k = 0; k < count; ++k) next[starts[(keys[order[k]] >>> shift) & (side - 1)]++] = order[k];
    order = next;
  }
  return order;
}

// A worker that sorts, told of the places once. Throws an error where none may be started.
function makeSorter(places, sorted) {
  const text = `let places; const sort = ${depthOrder}; onmessage = ({ data }) => {
    if (!places) places = data;
    else { const order = sort(places, data, ${DIGIT}); postMessage({ order, direction: data }, [order.buffer]); }
  };`;
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" })), worker = new Worker(address);
  worker.onmessage = ({ data }) => sorted(data);
  worker.postMessage(places);
  return worker;
}

// What page/parts.py has packed, as textures.
async function takeSplats(gl, reader, head) {
  const { count, low, step, harmonics, entries } = head, rows = (each) => Math.max(Math.ceil((each * count) / ROW), 1);
  const planes = head.bytes.map((size) => wholePlane(reader, count, 1, null, count, size));
  const colors = colorPlanes(reader, count, 1, null, count), shapes = new Uint8Array(16 * (ROW / 4) * rows(4));
  const columns = [3, 4, 5, 6, 8, 9, 10, 11, 7, 12, 13, ...(harmonics ? [14, 15] : [])].map((at) => [at, reader.take(count)]);
  const places = new Float32Array(3 * count), texels = new Float32Array(4 * ROW * rows(1));
  for (let k = 0; k < count; ++k) {
    for (let axis = 0; axis < 3; ++axis) {
      places[3 * k + axis] = texels[4 * k + axis] = low[axis] + step * planes[axis][k];
      shapes[16 * k + axis] = colors[4 * k + axis];
    }
    for (const [at, bytes] of columns) shapes[16 * k + at] = bytes[k];
  }
  const height = Math.max(Math.ceil(entries / ENTRIES), 1), palette = new Uint8Array(4 * ENTRY * ENTRIES * height);
  const stored = reader.take(3 * harmonics * entries);
  for (let k = 0; k < harmonics * entries; ++k)
    for (let c = 0; c < 3; ++c) palette[4 * (ENTRY * Math.floor(k / harmonics) + (k % harmonics)) + c] = stored[3 * k + c];
  return {
    ...head, sorted: places, places: makeTexture(gl, "rgba32f", ROW, rows(1), texels), shapes: makeTexture(gl, "rgba8", ROW, rows(4), shapes),
    palette: makeTexture(gl, "rgba8", ENTRY * ENTRIES, height, palette),
  };
}

class SplatLayer {
  constructor(gl, painter, thing, format) {
    Object.assign(this, { gl, painter, thing, format, size: [0, 0], images: {}, blended: "", version: 0, changed: () => {} });
    this.order = this.lampOrder = null;
    this.direction = this.wanted = null;
    this.isBusy = false;
    try {
      this.worker = makeSorter(thing.sorted, (found) => this.take(found));
      this.worker.onerror = () => {
        Object.assign(this, { worker: null, isBusy: false });
        this.changed();
      };
    } catch {
      this.worker = null; // this thread sorts
    }
  }

  // Whether they are in order for the view that was asked for last.
  get isSorted() {
    return this.direction === this.wanted || String(this.direction) === String(this.wanted);
  }

  // The view has turned: the worker sorts, or this thread if it must be done now.
  turn(pose, isNow) {
    this.wanted = transposed(rotation(pose))[2];
    if (this.isSorted) return;
    if (isNow || !this.worker || !this.order) this.setOrder(depthOrder(this.thing.sorted, this.wanted, DIGIT), this.wanted);
    else if (!this.isBusy) {
      this.isBusy = true;
      this.worker.postMessage(this.wanted);
    }
  }

  take({ order, direction }) {
    this.isBusy = false;
    if (!this.isSorted) this.setOrder(order, direction);
    this.changed();
  }

  setOrder(order, direction) {
    this.order = this.putOrder(this.order, order);
    Object.assign(this, { direction, blended: "" });
  }

  putOrder(texture, order) {
    const { gl } = this, rows = Math.max(Math.ceil(order.length / ROW), 1), texels = new Int32Array(ROW * rows);
    texels.set(order);
    if (!texture) return makeTexture(gl, "r32i", ROW, rows, texels);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, gl.RED_INTEGER, gl.INT, texels);
    return texture;
  }

  // A picture of the view's size, made when it is first needed: { textures, target }.
  image(name, ...formats) {
    if (!this.images[name]) {
      const textures = formats.map((format) => makeTexture(this.gl, format, ...this.size));
      this.images[name] = { textures, target: makeTarget(this.gl, textures) };
    }
    return this.images[name];
  }

  fit(size) {
    if (String(size) === String(this.size)) return;
    for (const { textures, target } of Object.values(this.images)) {
      for (const texture of textures) this.gl.deleteTexture(texture);
      this.gl.deleteFramebuffer(target);
    }
    Object.assign(this, { size: [...size], images: {}, blended: "" });
  }

  // How far the middle of all lies ahead of who looks.
  reference(pose) {
    return dot(transposed(rotation(pose))[2], minus(this.thing.centre, translation(pose)));
  }

  get thickness() {
    return this.format === "rgba32f" ? this.thing.thickness : FAR_APART;
  }

  // Blends all splats into a cleared target. opaque: the surfaces of other things, which may hide them.
  drawSplats(target, size, kind, order, { camera, pose, near }, isLit, opaque = null) {
    const { gl, thing, painter } = this;
    painter.clear(target);
    if (!thing.count) return;
    painter.begin(target, [0, 0, ...size], false);
    painter.programs.get("splats/packed.vert", "splats/splat.frag", { KIND: kind, HIDDEN: opaque ? 1 : 0 }).use({
      order_map: order, places: thing.places, shapes: thing.shapes, palette: thing.palette, deviations: thing.deviations,
      bases: thing.bases, harmonics: thing.harmonics, shine: thing.shine, is_lit: isLit, view: inverted(pose), eye: translation(pose),
      target: [camera.fx, camera.fy, camera.cx, camera.cy], target_size: size, near, reference: this.reference(pose), opaque_map: opaque,
    });
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * thing.count);
    gl.disable(gl.BLEND);
  }

  // Blends what an eye sees. key: of the opaque surfaces that it has there; hasSurface: with normals and depths.
  blend(eye, opaque, key, hasSurface, isLit) {
    const now = JSON.stringify([eye, key, hasSurface, isLit]);
    if (now === this.blended) return;
    Object.assign(this, { blended: now, version: this.version + 1 });
    const { painter, format, size, thing } = this, { camera, pose } = eye, box = [0, 0, ...size];
    if (!hasSurface) {
      this.colors = this.image("colors", format);
      this.drawSplats(this.colors.target, size, 0, this.order, eye, false, opaque);
      return;
    }
    this.colors = this.image("sums", format, "rgba16f", format);
    this.drawSplats(this.colors.target, size, 1, this.order, eye, isLit, opaque);
    const [, normals_map, depths_sum] = this.colors.textures, seen = this.image("seen", "rgba32f"), fitted = this.image("fitted", "rgba32f");
    painter.clear(seen.target);
    const target = [camera.fx, camera.fy, camera.cx, camera.cy], depths = { depths_sum, target, reference: this.reference(pose), thickness: this.thickness };
    painter.fill(seen.target, box, "splats/depth.frag", {}, depths, false);
    painter.clear(fitted.target);
    const unlit = isLit && !thing.isMixed ? 0 : UNLIT;
    painter.fill(fitted.target, box, "splats/surface.frag", {}, { normals_map, seen_map: seen.textures[0], target, shares: SHARES, unlit }, false);
  }

  // Their surface among that of other things, as the light pass reads them. number: of their material.
  merge(opaque, number, hasVisibility) {
    const merged = this.image("merged", "rgba32f", "rgba16f", ...(hasVisibility ? ["rgba32f"] : []));
    const [surface, albedo, visibility] = merged.textures, OPAQUE = opaque ? (hasVisibility ? 2 : 1) : 0;
    const behind = opaque ? { opaque_map: opaque.surface, opaque_colors: opaque.albedo, opaque_visibility: opaque.visibility } : {};
    const own = { colors_sum: this.colors.textures[0], fitted: this.image("fitted").textures[0], least: ANY, number };
    for (const k of merged.textures.keys()) {
      this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, merged.target);
      this.gl.clearBufferfv(this.gl.COLOR, k, [0, 0, 0, 0]);
    }
    this.painter.fill(merged.target, [0, 0, ...this.size], "splats/merge.frag", { OPAQUE }, { ...own, ...behind }, false);
    return { surface, albedo, visibility };
  }

  // Adds the picture to a sum: the splats over what is behind them.
  compose(target, isLit, hasBehind) {
    const inputs = { colors_sum: this.colors.textures[0] };
    if (isLit) inputs.lit_sum = this.image("lit").textures[0];
    if (hasBehind) inputs.behind_sum = this.image("behind").textures[0];
    const constants = { LINEAR: 1, LIT: isLit ? 1 : 0, BEHIND: hasBehind ? 1 : 0 };
    this.painter.adding(true, () => this.painter.fill(target, [0, 0, ...this.size], "splats/compose.frag", constants, inputs, false));
  }

  // The map of their shadows, tiles as in the shadow map.
  fitShadows(size, side) {
    const { gl } = this;
    for (const { texture, target } of this.shadows || []) {
      gl.deleteTexture(texture);
      gl.deleteFramebuffer(target);
    }
    this.shadows = [["rgba32f", ...size], [this.format, side, side]].map((form) => {
      const texture = makeTexture(gl, ...form);
      return { texture, target: makeTarget(gl, [texture]) };
    });
  }

  addShadow({ camera, pose, near, first }, side) {
    const [map, tile] = this.shadows, direction = transposed(rotation(pose))[2];
    this.lampOrder = this.putOrder(this.lampOrder, depthOrder(this.thing.sorted, direction, DIGIT));
    this.drawSplats(tile.target, [side, side], 2, this.lampOrder, { camera, pose, near }, false);
    const reference = this.reference(pose), across = (BESIDE * this.thing.thickness * camera.fx) / Math.max(reference, near);
    const stride = limited(Math.round(across), 1, WIDEST), inputs = { depths_sum: tile.texture, first, reference, thickness: this.thickness, stride };
    this.painter.fill(map.target, [...first, side, side], "splats/shadow.frag", {}, inputs, false);
  }
}

// The drawing of a page with trained splats (pipeline/frame_pass.py): over the picture of all other things.
class SplatDrawing extends Drawing {
  constructor(gl, programs, things, data) {
    super(gl, programs, things, data);
    this.layer = new SplatLayer(gl, this.painter, things.find(({ kind }) => kind === "splats"), this.format);
    this.lit = "";
  }

  get hasBehind() {
    return this.things.length > 1;
  }

  // In the order that is known until the worker has that of the view.
  drawFirst() {
    this.fitSums();
    this.painter.clear(this.sums);
    this.layer.turn(this.shown.view.pose, false);
    finished(this.sample(0, this.sums, true));
    this.develop(1);
  }

  refine() {
    this.layer.turn(this.shown.view.pose, true);
    super.refine();
  }

  // In all samples splats are as each pixel's middle sees them, with what hides them in the first one.
  lightSample(eye, shadings, lamps, sample, target) {
    const { layer, shown, hasBehind } = this, place = this.things.indexOf(layer.thing), own = shadings[place];
    const steady = { ...shown.view, near: this.near(eye.pose) }, isLit = !NOT_LIT.includes(own), hasSurface = own !== "none";
    layer.fit(this.size);
    if (hasBehind) {
      const behind = layer.image("behind", "rgba16f");
      this.painter.clear(behind.target);
      this.lightPixels(eye, shadings, lamps, sample, behind.target, true);
    }
    layer.blend(steady, hasBehind ? this.surface : null, shadings, hasSurface, isLit);
    const light = JSON.stringify([layer.version, lamps.lights, this.around.occlusion && sample]);
    if (hasSurface && light !== this.lit) {
      const lit = layer.image("lit", "rgba16f"), images = { ...this.merge(own === "edl" ? -1 - place : place + 1), size: this.size };
      this.painter.clear(lit.target);
      this.hiddenIn = "";
      this.lightPixels(steady, shadings, lamps, sample, lit.target, true, images);
      this.hiddenIn = "";
      this.lit = light;
    }
    layer.compose(target, hasSurface, hasBehind);
  }

  merge(number) {
    return this.layer.merge(this.hasBehind ? this : null, number, Boolean(this.around.occlusion));
  }

  // With the surface of splats, also where only their colours are shown.
  shownSurfaces() {
    const { layer, shown } = this;
    layer.blend({ ...shown.view, near: this.near(shown.view.pose) }, this.hasBehind ? this.surface : null, [], true, false);
    this.merge(1);
    return layer.image("merged").target;
  }

  fitShadows(count, side, size) {
    super.fitShadows(count, side, size);
    this.layer.fitShadows(size.map((one) => Math.max(one, 1)), Math.max(side || 0, 1));
  }

  *drawShadow(thing, view, side, isCoarse) {
    if (thing.kind === "splats") this.layer.addShadow(view, side);
    else yield* super.drawShadow(thing, view, side, isCoarse);
  }

  fillLight(target, size, constants, own, lamps, axes) {
    super.fillLight(target, size, { ...constants, SPLATS: lamps.views.length ? 1 : 0 }, own, lamps, axes);
  }

  lightInputs(lamps, axes, withShadows) {
    const [map] = this.layer.shadows || [], inputs = super.lightInputs(lamps, axes, withShadows);
    return map ? { ...inputs, splat_map: map.texture, splat_thickness: this.layer.thing.thickness } : inputs;
  }
}
