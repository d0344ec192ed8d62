// Point clouds: discs that are blended into a surface, or balls (gpu/clouds/cloud_objects.py).

const FEW = 4; // points for each that is drawn in a hurry, along their curve
const AT_ONCE = 32768; // points of a step
const POINT_FLOATS = 10; // of each point; its colour lies in a buffer of its own
const POINT_LAYOUT = { position: [3, 0], spacing: [1, 12], normal: [3, 16], edge: [3, 28] }; // numbers, first byte

// The points of a cloud on the GPU.
function takeCloud(gl, reader, head) {
  const { points, colors } = cloudPoints(reader, head);
  return { ...head, points: makeBuffer(gl, gl.ARRAY_BUFFER, points), colors: makeBuffer(gl, gl.ARRAY_BUFFER, colors) };
}

// An even share of the points, larger by as much: they cover what all do.
function fewPoints(thing) {
  const { discs, count, radius: [world, spacings, pixels] } = thing, number = Math.ceil(discs / FEW);
  const larger = Math.sqrt(FEW), shown = { discs: number, count: number + Math.ceil((count - discs) / FEW), firstBall: discs };
  return { ...thing, ...shown, every: FEW, radius: [larger * world, larger * spacings, pixels] };
}

class CloudPainter {
  constructor(gl, programs, painter, format) {
    Object.assign(this, { gl, programs, painter, format, size: [0, 0], textures: [], targets: [] });
    this.largest = gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1];
  }

  // Draws a cloud among the surfaces of other things. isCoarse: few points, as their cores are.
  *addSurface(target, size, whole, eye, shown, isCoarse) {
    const thing = isCoarse ? fewPoints(whole) : whole, share = isCoarse && whole.isBlended ? whole.rules.core : 1;
    const { painter } = this, box = [0, 0, ...size], inputs = { ...this.inputs(thing, eye, share), ...shown };
    if (isCoarse || !thing.isBlended) {
      yield* this.drawPoints(target, box, "ball", thing, eye, inputs);
      return;
    }
    this.fit(size);
    yield* this.findFront(thing, eye);
    painter.clear(this.sums, 2);
    const onFront = { ...inputs, front: this.front, band: thing.rules.band };
    yield* this.drawPoints(this.sums, box, "blend", thing, eye, onFront, true);
    const maps = { geometry_map: this.geometry, albedo_map: this.albedo, front: this.front };
    const constants = { COARSE: this.format === "rgba16f" ? 1 : 0 };
    painter.fill(target, box, "clouds/resolve.frag", constants, { ...inputs, ...maps });
  }

  // Draws the depth of a cloud into a box of the shadow map.
  *addShadow(target, box, whole, eye, isCoarse) {
    const thing = isCoarse ? fewPoints(whole) : whole, { shadowShare, shadowPush } = thing.rules;
    const inputs = { ...this.inputs(thing, eye, shadowShare), push: shadowPush, first_pixel: box.slice(0, 2) };
    yield* this.drawPoints(target, box, "depth", thing, eye, inputs);
  }

  // The front surface: that of the cores of discs, closed between them.
  *findFront(thing, eye) {
    const { gl, painter } = this, { core, stepBack, ring } = thing.rules, box = [0, 0, ...this.size];
    painter.begin(this.coreTarget, box, true);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    const ofCores = { ...this.inputs(thing, eye, core), push: 0, first_pixel: [0, 0] };
    yield* this.drawPoints(this.coreTarget, box, "depth", thing, eye, ofCores);
    const away = this.away(thing, eye), focal = (Math.abs(eye.camera.fx) + Math.abs(eye.camera.fy)) / 2;
    const [world, spacings, pixels] = thing.radius;
    const radius = thing.scale * (world + spacings * thing.spacing) + (pixels * away) / focal;
    const inputs = { cores: this.cores, near: eye.near, step_back: stepBack * radius, ring: [ring * radius * focal, (ring * radius * focal) / away] };
    painter.fill(this.frontTarget, box, "clouds/front.frag", {}, inputs, false);
  }

  // How far the middle of a cloud lies ahead.
  away(thing, { pose, near }) {
    return Math.max(dot(transposed(rotation(pose))[2], minus(translation(thing.axes), translation(pose))), near);
  }

  // The uniforms of clouds/splat.vert.
  inputs(thing, { camera, pose, near }, share) {
    const { scale, radius } = thing, view = product(inverted(pose), thing.axes);
    const scaled = view.map((row, k) => (k < 3 ? [...times(row.slice(0, 3), scale), row[3]] : row));
    const target = [camera.fx, camera.fy, camera.cx, camera.cy], target_size = [camera.width, camera.height];
    return { view: scaled, scale, radius, share, target, target_size, near };
  }

  // What the box of no point is wider than in a view, pixels.
  widest({ radius: [world, spacings, pixels], scale, largest, low, high }, { camera, near }, view) {
    const { fx, fy, cx, cy, width, height } = camera, size = scale * (world + spacings * largest), ahead = view[2];
    const box = low.reduce((sum, least, k) => sum + Math.min(ahead[k] * least, ahead[k] * high[k]), ahead[3]);
    const focal = (Math.abs(fx) + Math.abs(fy)) / 2, share = Math.min(size / Math.max(box, near + 2 * size) + pixels / focal, 0.5);
    const aside = Math.max(...[cx / fx, (width - cx) / fx, cy / fy, (height - cy) / fy].map(Math.abs));
    return (2 * Math.max(fx, Math.abs(fy)) * share * Math.hypot(1, aside + 2 * share)) / (1 - share);
  }

  // Draws the discs of a cloud, and its balls, into a box of a target: some in each step. isAdded: to what is there.
  *drawPoints(target, box, name, thing, eye, inputs, isAdded = false) {
    const { gl, painter } = this;
    const { count, discs, isBlended, rules } = thing, QUADS = this.widest(thing, eye, inputs.view) > this.largest ? 1 : 0;
    const balls = { ...inputs, push: 0, share: isBlended ? rules.ballShare : 1 };
    const kinds = [[0, 0, discs, inputs], [1, thing.firstBall ?? discs, count - discs, balls]];
    for (const [BALLS, first, all, own] of kinds) {
      for (let k = 0; k < all; k += AT_ONCE) {
        const some = Math.min(AT_ONCE, all - k), start = first + k * (thing.every ?? 1);
        painter.begin(target, box, !isAdded);
        gl.enable(gl.SCISSOR_TEST); // points reach over the viewport
        gl.scissor(...box);
        painter.adding(isAdded, () => this.drawSome(name, thing, { BALLS, QUADS }, start, some, own));
        gl.disable(gl.SCISSOR_TEST);
        yield;
      }
    }
  }

  drawSome(name, thing, constants, first, count, inputs) {
    const gl = this.gl, program = this.programs.get("clouds/splat.vert", `clouds/${name}.frag`, constants);
    program.use(inputs);
    const places = Object.entries(POINT_LAYOUT).map(([key, layout]) => [program.attribute(key), ...layout]).filter(([place]) => place >= 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, thing.points);
    const bytes = 4 * POINT_FLOATS, every = thing.every ?? 1;
    for (const [place, numbers, from] of places) gl.vertexAttribPointer(place, numbers, gl.FLOAT, false, every * bytes, bytes * first + from);
    const color = program.attribute("color");
    if (color >= 0) {
      gl.bindBuffer(gl.ARRAY_BUFFER, thing.colors);
      gl.vertexAttribPointer(color, 4, gl.UNSIGNED_BYTE, true, 4 * every, 4 * first);
      places.push([color]);
    }
    for (const [place] of places) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribDivisor(place, constants.QUADS);
    }
    if (constants.QUADS) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    else gl.drawArrays(gl.POINTS, 0, count);
    for (const [place] of places) {
      gl.disableVertexAttribArray(place);
      gl.vertexAttribDivisor(place, 0);
    }
  }

  // Pictures of the view's size.
  fit(size) {
    const gl = this.gl, [width, height] = size;
    if (this.size[0] === width && this.size[1] === height) return;
    for (const texture of this.textures) gl.deleteTexture(texture);
    for (const target of this.targets) gl.deleteFramebuffer(target);
    this.textures = ["depth", "r32f", this.format, this.format].map((format) => makeTexture(gl, format, width, height));
    [this.cores, this.front, this.geometry, this.albedo] = this.textures;
    this.targets = [makeTarget(gl, [], this.cores), makeTarget(gl, [this.front]), makeTarget(gl, [this.geometry, this.albedo])];
    [this.coreTarget, this.frontTarget, this.sums] = this.targets;
    this.size = [...size];
  }
}
