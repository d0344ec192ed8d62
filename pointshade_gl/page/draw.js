// Draws a page's things: what is seen of them, then light once a pixel (pipeline/pipeline.py). What has not changed stays.
// At rest more samples are added to a picture, and their mean is shown (pipeline/accumulation.py).

const NEAR = 0.001; // share of the distance to what is looked at
const SLOW = 100; // milliseconds of a picture, beyond which what moves is drawn coarser
const COARSE = [2, 4]; // pixels of the canvas for each that is drawn then, across and down
const COARSE_PIXELS = 1e5; // if so many are enough for that
const COARSE_SHADOW_SIDE = 256; // pixels of a view of a light then
const TURN = [30, 80]; // milliseconds: of a turn that has fewer the next does more, and less of one that has more

// Does all of what can be done in steps.
function finished(steps) {
  while (!steps.next().done);
}

// What is on the page -> { draw(view, lights, options), refine() }. Throws an error where WebGL 2 cannot draw it.
async function createDrawing(canvas, data) {
  const gl = canvas.getContext("webgl2", { antialias: false, depth: false, premultipliedAlpha: false });
  if (!gl) throw new Error("this browser has no WebGL 2");
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("this GPU cannot draw to pictures of floats");
  const [texts, bytes] = await Promise.all([unpacked(data.shaders), unpacked(data.parts)]);
  const programs = new Programs(gl, JSON.parse(new TextDecoder().decode(texts)));
  const kind = data.things.some((head) => head.kind === "splats") ? SplatDrawing : Drawing;
  const drawing = new kind(gl, programs, await takeThings(gl, new Reader(bytes), data.things), data);
  if (data.film) drawing.film = new Film(gl, drawing.painter, drawing.things[0]);
  return drawing;
}

class Drawing {
  constructor(gl, programs, things, data) {
    Object.assign(this, { gl, things, data, size: [0, 0], images: [], shadowLayout: "", shadowsOf: [], count: 0, took: 0, pace: 1 });
    this.painter = new Painter(gl, programs);
    this.around = new Around(gl, this.painter, data.around);
    this.format = gl.getExtension("EXT_float_blend") ? "rgba32f" : "rgba16f"; // of sums
    const [hasSets, hasClouds, hasPoints] = ["set", "cloud", "points"].map((kind) => things.some((one) => one.kind === kind));
    if (hasClouds) this.clouds = new CloudPainter(gl, programs, this.painter, this.format);
    if (hasSets) this.sets = new SetPainter(gl, this.painter, this.format);
    this.isHeavy = hasSets || hasClouds;
    this.hasCoarse = this.isHeavy || (hasPoints && !data.film); // what a hurry draws coarsely
    this.outlines = new Outlines(gl, this.painter);
    const materials = things.map((thing) => [...thing.material, thing.lobe, 0, 0, 0]);
    this.materials = makeTexture(gl, "rgba32f", 2, materials.length, new Float32Array(materials.flat()));
    for (const thing of things.flatMap((one) => one.views ?? [one]).filter((one) => one.kind === "points")) {
      thing.lit = makeTexture(gl, "rgba16f", thing.width, thing.height);
      thing.litTarget = makeTarget(gl, [thing.lit]);
    }
  }

  // One sample of a picture: as it is while something moves.
  // view: { camera, pose }, the pose in home axes; lights with positions and directions there, too.
  // options: { shading, shadows, hurries }; a shading other than phong is for all things; without shadows no light casts
  // any; in a hurry every second point of a film is drawn where the view is too small to show each, and of a page with
  // clouds or frames a coarse picture, or coarse shadows where only a light moves.
  draw(view, lights, { shading, shadows, hurries } = {}) {
    const { canvas } = this.gl, { width, height } = view.camera;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const shadings = this.things.map((thing) => (shading && shading !== "phong" ? shading : thing.shading));
    this.shown = { lights: lights.map((one) => ({ ...one, shadow: one.shadow && shadows !== false })), shadings };
    this.hurries = hurries;
    this.look(view, Boolean(hurries && this.hasCoarse) && !this.isSeen(view));
    this.drawFirst();
    this.present();
    this.mark();
  }

  // Whether what is seen in a view is known: then only its light is drawn anew.
  isSeen({ camera, pose }) {
    return Boolean(this.images.length) && this.images[0].seen === this.keyOf({ camera, pose }, this.shown.lights);
  }

  // What surfaces that were drawn depend on.
  keyOf({ camera, pose }, lights) {
    const { shadings } = this.shown, early = shadings.some((one) => LIT_EARLY.includes(one));
    return JSON.stringify([camera, pose, shadings, Boolean(this.film && this.hurries), early && lights]);
  }

  // Begins a picture of a view, perhaps a coarse one.
  look(view, isCoarse) {
    const { width, height } = view.camera, step = limited(Math.sqrt((width * height) / COARSE_PIXELS), ...COARSE);
    const size = [width, height].map((side) => Math.ceil(side / step)), camera = isCoarse ? fitted(view.camera, ...size) : view.camera;
    this.fit(camera.width, camera.height);
    Object.assign(this, { view, isCoarse, isShown: false, count: 0, kept: null, steps: null, spent: 0, isMeasured: false });
    this.shown.view = { ...view, camera };
  }

  // Then there is a picture, unless it is coarse.
  drawFirst() {
    finished(this.sample(0, this.picture, false));
    this.isShown = !this.isCoarse && !this.hasCoarseShadows;
  }

  // Adds a sample to what was drawn. The mean is shown where it lies in the middle of the first sample's pixels: pairs of
  // samples face each other. After a coarse picture the first one is fine. Slow ones take several turns.
  refine() {
    if (this.isCoarse) this.look(this.view, false);
    if (!this.steps) this.begin();
    let isDone = false;
    for (let k = 0; !isDone && !(this.isSlow && k >= this.pace); ++k) isDone = this.steps.next().done;
    if (isDone) {
      this.steps = null;
      ++this.count;
    }
    if (isDone && (this.count % 2 || this.isFine)) {
      this.develop();
      this.present();
    }
    this.mark();
  }

  begin() {
    this.fitSums();
    if (!this.count) this.painter.clear(this.sums);
    if (this.count === 1) this.keepInsides();
    this.steps = this.sample(this.count, this.sums, true);
  }

  // From now on it is busy until all that was asked for is drawn.
  mark() {
    const { gl } = this;
    gl.deleteSync(this.fence || null);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.began = performance.now();
    gl.flush();
  }

  // Whether the picture has all its samples.
  get isFine() {
    return !this.isCoarse && this.count >= this.data.samples;
  }

  // Whether the last picture or turn of a sample is still being drawn.
  get isBusy() {
    const { gl, fence } = this;
    if (!fence || gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) return Boolean(fence);
    gl.deleteSync(fence);
    this.fence = null;
    this.measure(performance.now() - this.began);
    return false;
  }

  // Notes how long the last turn took.
  measure(time) {
    this.spent += time;
    if (this.steps) this.pace = Math.max(time < TURN[0] ? 2 * this.pace : time > TURN[1] ? this.pace >> 1 : this.pace, 1);
    else {
      if (this.isMeasured && !this.isCoarse) this.took = this.spent;
      Object.assign(this, { spent: 0, isMeasured: false });
    }
  }

  // Whether pictures take so long that what moves should be drawn in a hurry.
  get isSlow() {
    return this.took > SLOW;
  }

  // Draws a sample, or adds it to a sum of linear light: in steps, none of which takes long.
  *sample(k, target, isSummed) {
    const { shadings, view } = this.shown, eye = { pose: view.pose, camera: shiftedCamera(view.camera, k) };
    const lights = this.shown.lights.map((one) => movedLight(one, k, this.data.bounds.centre, this.data.toWorld));
    const lamps = yield* this.hangUp(lights, lightPart(k), isSummed), seen = this.keyOf(eye, lights);
    this.useImages(k && this.isHeavy && this.isSlow ? 1 : 0); // so the first sample can be lit anew at once
    if (seen !== this.seen) {
      this.seen = "";
      this.isMeasured = true;
      yield* this.drawSurfaces(eye, shadings, lamps);
      this.seen = seen;
    }
    this.lightSample(eye, shadings, lamps, k, target, isSummed);
  }

  // What the surfaces that are drawn now show.
  get seen() {
    return this.current.seen;
  }

  set seen(key) {
    this.current.seen = key;
  }

  lightSample(...sample) {
    this.lightPixels(...sample);
  }

  // From now on samples draw only the outlines of points anew, where what is shown is mixed from several points.
  keepInsides() {
    const [thing, ...others] = this.things, { view, shadings } = this.shown;
    if (others.length || thing.kind !== "points" || thing.sizes || shadings[0] !== "phong") return;
    this.kept = this.outlines.note(this.splats, this, thing, warpOf(thing, view.camera, view.pose, this.near(view.pose)));
  }

  // The mean of the samples as a picture.
  develop(count = this.count) {
    this.isShown = !this.isCoarse;
    const background = this.data.behind ? [...this.data.behind, 1] : [0, 0, 0, 0], sums = this.sum;
    const inputs = { sums, grounds: sums, count, background };
    this.painter.fill(this.picture, [0, 0, ...this.size], "output/resolve_samples.frag", { TONE: this.rollsOff ? 1 : 0 }, inputs, false);
  }

  // Shows the picture on the page.
  present() {
    const gl = this.gl, { width, height } = gl.canvas, filter = this.isCoarse ? gl.LINEAR : gl.NEAREST;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.picture);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, ...this.size, 0, height, width, 0, gl.COLOR_BUFFER_BIT, filter);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null); // Chromium shows nothing after its canvas was resized while another was bound
  }

  // The film shows another frame.
  changeFrame({ bounds, distance }) {
    Object.assign(this, { data: { ...this.data, bounds, distance }, shadowsOf: "" });
    for (const images of this.images) images.seen = "";
  }

  // Whether light above white rolls off in what is shown.
  get rollsOff() {
    return this.data.tone === "neutral" && this.shown.shadings.some((one) => !NOT_LIT.includes(one));
  }

  // The last picture: RGBA bytes, top row first.
  read() {
    const gl = this.gl, [width, height] = this.size, pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }

  // How far away is what the last picture shows at a pixel, along the viewer's axis; 0 where it shows nothing.
  depthAt(x, y) {
    const gl = this.gl, surface = new Float32Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shownSurfaces());
    const { canvas } = gl, [column, row] = [x / canvas.width, y / canvas.height].map((share, k) => Math.floor(share * this.size[k]));
    gl.readPixels(column, row, 1, 1, gl.RGBA, gl.FLOAT, surface);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return Math.abs(surface[3]);
  }

  shownSurfaces() {
    return this.images[0].target;
  }

  fit(width, height) {
    const gl = this.gl;
    if (this.size[0] === width && this.size[1] === height) return;
    for (const texture of [...(this.textures || []), ...this.images.flatMap((one) => one.textures)]) gl.deleteTexture(texture);
    for (const target of [this.splats, this.picture, this.sums, ...this.images.map((one) => one.target)]) gl.deleteFramebuffer(target || null);
    gl.deleteTexture(this.sum || null);
    this.sums = this.sum = null;
    this.textures = ["r32i", "depth", "rgba8"].map((format) => makeTexture(gl, format, width, height));
    [this.ids, this.depth, this.color] = this.textures;
    this.splats = makeTarget(gl, [this.ids], this.depth);
    this.picture = makeTarget(gl, [this.color]);
    Object.assign(this, { size: [width, height], images: [] });
    this.useImages(0);
  }

  // From now on these surfaces are drawn and lit, made when they are first needed.
  useImages(number) {
    const { gl, images } = this;
    if (!images[number]) {
      const textures = ["rgba32f", "rgba16f", "depth", "rgba32f"].map((format) => makeTexture(gl, format, ...this.size));
      const [surface, albedo, nearest, visibility] = textures;
      const target = makeTarget(gl, [surface, albedo, ...(this.around.occlusion ? [visibility] : [])], nearest);
      images[number] = { textures, target, seen: "" };
    }
    this.current = images[number];
    this.surfaces = this.current.target;
    [this.surface, this.albedo, , this.visibility] = this.current.textures;
  }

  // The sum of samples, from when there is one.
  fitSums() {
    if (this.sums) return;
    this.sum = makeTexture(this.gl, this.format, ...this.size);
    this.sums = makeTarget(this.gl, [this.sum]);
  }

  // The lights with their shadow map, of which is drawn what has to be other than the last.
  *hangUp(lights, part, isSummed) {
    const planned = (side) => shadowViews(lights, this.data.bounds, this.data.toWorld, part, side);
    let plan = planned(SHADOW_SIDE);
    const mayBeCoarse = this.hurries && this.hasCoarse && !isSummed;
    this.hasCoarseShadows = mayBeCoarse && plan.views.length > 0 && !this.hasShadows(plan);
    if (this.hasCoarseShadows) plan = { ...planned(COARSE_SHADOW_SIDE), isCoarse: true };
    const isPlain = !plan.views.length && !lights.some((one) => one.position && one.direction);
    if (plan.views.length) yield* this.drawShadows(plan);
    return { lights, ...plan, isPlain, kind: isPlain ? 0 : plan.views.some((view) => view.spread) ? 2 : 1 };
  }

  // Whether the shadow map is as planned.
  hasShadows(plan) {
    return layoutOf(plan) === this.shadowLayout && plan.views.every((view, k) => JSON.stringify(view) === this.shadowsOf[k]);
  }

  *drawShadows(plan) {
    const { views, side, size } = plan, gl = this.gl, layout = layoutOf(plan);
    if (layout !== this.shadowLayout) this.fitShadows(views.length, side, size);
    this.shadowLayout = layout;
    for (const [k, view] of views.entries()) {
      const key = JSON.stringify(view);
      if (key === this.shadowsOf[k]) continue;
      this.shadowsOf[k] = "";
      this.isMeasured = true;
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(...view.first, side, side);
      gl.clearBufferfv(gl.DEPTH, 0, [1]);
      gl.disable(gl.SCISSOR_TEST);
      for (const thing of this.things) if (thing.shadow) yield* this.drawShadow(thing, view, side, plan.isCoarse);
      this.shadowsOf[k] = key;
    }
  }

  // Room for the views of lights, all of one size.
  fitShadows(count, side, size) {
    const gl = this.gl;
    for (const texture of [this.shadowMap, ...(this.scratch || [])]) gl.deleteTexture(texture || null);
    for (const target of [this.shadows, this.scratchTarget]) gl.deleteFramebuffer(target || null);
    this.shadowMap = makeTexture(gl, "depth", Math.max(size[0], 1), Math.max(size[1], 1));
    this.shadows = makeTarget(gl, [], this.shadowMap);
    this.scratch = count ? [makeTexture(gl, "r32i", side, side), makeTexture(gl, "depth", side, side)] : [];
    this.scratchTarget = count ? makeTarget(gl, [this.scratch[0]], this.scratch[1]) : null;
    this.shadowsOf = [];
  }

  *drawShadow(thing, { camera, pose, near, first }, side, isCoarse) {
    const box = [...first, side, side], [ids, depths] = this.scratch;
    if (thing.kind === "set" && isCoarse) {
      this.sets.drawFew(this.shadows, box, thing, { camera, pose, near }, { behind: thing.differ, number: 0, is_lit: false, visibilityOf: () => null });
      return;
    }
    if (thing.kind === "set") {
      yield* this.sets.addShadow(this.shadows, box, thing, { camera, pose, near }, first, { ids, splats: this.scratchTarget });
      return;
    }
    const warp = warpOf(thing, camera, pose, near);
    if (thing.kind === "cloud") {
      yield* this.clouds.addShadow(this.shadows, box, thing, { camera, pose, near }, isCoarse);
      return;
    }
    if (thing.kind === "mesh") {
      this.painter.drawMesh(this.shadows, box, "meshes/mesh.vert", "meshes/mesh_shadow.frag", thing, { ...warp, normal_view: normalView(warp.view) });
      return;
    }
    this.painter.drawSplats(this.scratchTarget, isCoarse && thing.few ? fewer(thing) : thing, warp);
    this.painter.fill(this.shadows, box, "shading/shadow.frag", {}, { ...warp, source_ids: ids, window_depths: depths, first });
    if (thing.stride) yield* this.drawShadow(this.hiddenBy(thing), { camera, pose, near, first }, side);
  }

  // What the points of a frame hide and what goes on behind them, as fewer points: gpu/surface/refinement.py.
  hiddenBy(thing) {
    if (thing.hidden) return thing.hidden;
    const { gl } = this, { stride, axes, scale } = thing, half = Math.floor(stride / 2);
    const [width, height] = [thing.width, thing.height].map((side) => Math.ceil(side / stride));
    const surface = makeTexture(gl, "rgba32f", width, height), known = makeIndices(gl, new Uint8Array(width * height).fill(1), 1);
    const target = makeTarget(gl, [surface]), inputs = { surface_map: thing.normals ?? thing.surface, source: thing.source, stride };
    this.painter.fill(target, [0, 0, width, height], "surface/hidden_planes.frag", {}, inputs, false);
    gl.deleteFramebuffer(target);
    const source = thing.source.map((value, k) => (k < 2 ? value : value - half) / stride);
    const size = 1, isRound = false, hasRims = false;
    return (thing.hidden = { kind: "points", surface, source, axes, scale, known, size, isRound, hasRims });
  }

  near(pose) {
    const { distance, bounds } = this.data;
    if (distance !== null) return NEAR * distance;
    return NEAR * Math.max(Math.hypot(...minus(bounds.centre, translation(pose))), bounds.radius);
  }

  *drawSurfaces({ camera, pose }, shadings, lamps) {
    const gl = this.gl, near = this.near(pose);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.surfaces);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    for (const [k, thing] of this.things.entries()) {
      const material_number = shadings[k] === "edl" ? -1 - k : k + 1;
      if (thing.kind === "set") yield* this.addSet(thing, material_number, { camera, pose, near }, shadings[k], lamps);
      const inputs = { ...warpOf(thing, camera, pose, near), material_number };
      const is_lit = !NOT_LIT.includes(shadings[k]);
      if (thing.kind === "cloud") yield* this.clouds.addSurface(this.surfaces, this.size, thing, { camera, pose, near }, { material_number, is_lit }, this.isCoarse);
      else if (thing.kind === "mesh") this.addMesh(thing, inputs, shadings[k], pose, lamps);
      else if (thing.kind === "points") this.addPoints(thing, inputs, shadings[k], pose, lamps, camera);
      yield;
    }
  }

  addPoints(thing, warp, shading, pose, lamps, camera) {
    const early = LIT_EARLY.includes(shading);
    if (early) this.lightPoints(thing, pose, lamps);
    this.painter.drawSplats(this.splats, (this.film ? this.hurries : this.isCoarse) && isFine(thing, camera) ? fewer(thing) : thing, warp, this.kept);
    const visibility_map = shading === "phong" ? this.around.ofPoints(thing) : null;
    const model = SHADINGS.indexOf(shading === "edl" ? "none" : shading);
    const constants = { SHADING: model, CERTAINTY: thing.certainty && shading === "phong" ? 1 : 0, VISIBILITY: visibility_map ? 1 : 0, CALM: thing.normals && shading === "phong" ? 1 : 0 };
    this.painter.fill(this.surfaces, [0, 0, ...this.size], "points/resolve_surfaces.frag", constants, {
      ...warp, near: warp.near * thing.scale, scale: thing.scale, depth_scale: warp.near, source_ids: this.ids,
      window_depths: this.depth, color_map: thing.colors, light_map: thing.lit, certainty_map: thing.certainty,
      visibility_map, light_normals: thing.normals,
    });
  }

  *addSet(thing, material_number, eye, shading, lamps) {
    if (!this.isCoarse && LIT_EARLY.includes(shading)) for (const view of thing.views) this.lightPoints(view, eye.pose, lamps);
    const visibilityOf = (view) => (shading === "phong" ? this.around.ofPoints(view) : null), is_lit = !NOT_LIT.includes(shading);
    if (this.isCoarse) this.sets.drawFew(this.surfaces, [0, 0, ...this.size], thing, eye, { number: material_number, is_lit, behind: 0, visibilityOf });
    else yield* this.sets.addSurface(this.surfaces, this.size, thing, eye, this, { shading, material_number, visibilityOf });
  }

  addMesh(thing, inputs, shading, pose, lamps) {
    const early = LIT_EARLY.includes(thing.shading), around = this.around.inputs(pose, this.data.exposure), box = [0, 0, ...this.size];
    const own = { picture: thing.colors, base_color: thing.baseColor, normal_view: normalView(inputs.view) };
    const light = early ? { ...this.lightInputs(lamps, pose, true), ...around, material: thing.material } : { is_lit: !NOT_LIT.includes(shading) };
    const names = early && !NOT_LIT.includes(shading) ? ["meshes/mesh_lit.vert", "meshes/mesh_lit.frag"] : ["meshes/mesh.vert", "meshes/mesh.frag"];
    this.painter.drawMesh(this.surfaces, box, ...names, thing, { is_lit: false, ...inputs, ...own, ...light });
  }

  // The light of points themselves, for shading models that mix it.
  lightPoints(thing, pose, lamps) {
    const eye = translation(product(inverted(thing.axes), pose));
    const own = {
      surface_map: thing.normals ?? thing.surface, color_map: thing.colors, intrinsics: thing.source, eye, scale: thing.scale,
      material: thing.material, certainty_map: thing.certainty, visibility_map: this.around.ofPoints(thing),
    };
    const constants = { POINTS: 1, CERTAINTY: thing.certainty ? 1 : 0 };
    this.painter.clear(thing.litTarget);
    this.fillLight(thing.litTarget, [thing.width, thing.height], constants, own, lamps, thing.axes);
  }

  lightPixels({ camera, pose }, shadings, lamps, sample, target, isSummed, images = this) {
    const own = {
      surface_map: images.surface, albedo_map: images.albedo, intrinsics: [camera.fx, camera.fy, camera.cx, camera.cy],
      eye: [0, 0, 0], material: this.things[0].material, materials: this.materials,
    };
    if (this.around.occlusion) own.visibility_map = this.visibilityOf(camera, pose, sample, images);
    const constants = {
      POINTS: 0, MATERIALS: this.things.length > 1 ? 1 : 0,
      CERTAINTY: this.things.some((thing) => thing.certainty) ? 1 : 0,
      EDL: shadings.includes("edl") ? 1 : 0, LINEAR: isSummed ? 1 : 0, TONE: this.rollsOff && !isSummed ? 1 : 0,
    };
    if (!isSummed) this.painter.clear(target);
    this.painter.adding(isSummed, () => this.fillLight(target, this.size, constants, own, lamps, pose));
  }

  // What all that is seen sees of the light from all around.
  visibilityOf({ fx, fy, cx, cy }, pose, sample, { surface, albedo, visibility, size }) {
    if (this.things.length === 1 && ["points", "set"].includes(this.things[0].kind)) return this.visibility;
    const distance = this.near(pose) / NEAR;
    if (this.hiddenIn !== this.seen) this.hiding = this.around.ofView({ surface, albedo, visibility, size, intrinsics: [fx, fy, cx, cy], distance, sample });
    this.hiddenIn = this.seen;
    return this.hiding;
  }

  // Lights all pixels of a cleared target: light.frag.
  fillLight(target, size, constants, own, lamps, axes) {
    const inputs = { ...own, ...this.lightInputs(lamps, axes, !lamps.isPlain), ...this.around.inputs(axes, this.data.exposure) };
    const variant = { ...constants, ...this.around.constants, SHADOWS: lamps.kind, ALONE: inputs.only_light ? 1 : 0 };
    this.painter.fill(target, [0, 0, ...size], "shading/light.frag", variant, inputs, false);
  }

  // What shaders/common/lights.glsl reads, or shadowed_lights.glsl, for surfaces in these axes.
  lightInputs({ lights, views, spans }, axes, withShadows) {
    const { exposure } = this.data, ambient = times(this.data.ambient, this.around.bands ? 0 : exposure);
    const rows = lightRows(lights.map((one) => ({ ...one, intensity: exposure * one.intensity })), axes, spans);
    if (!withShadows && lights.length === 1)
      return { only_light: transposed([0, 4, 8, 12].map((k) => [...rows.subarray(k, k + 4)])), ambient };
    const inputs = { lights: this.painter.table("lights", rows), light_count: lights.length, ambient };
    if (!withShadows) return inputs;
    if (!this.shadowMap) finished(this.drawShadows({ views: [], size: [1, 1] }));
    const to_world = product(this.data.toWorld, rotation(axes));
    return { ...inputs, shadow_map: this.shadowMap, views: this.painter.table("views", shadowRows(views, axes), 6), to_world };
  }
}
