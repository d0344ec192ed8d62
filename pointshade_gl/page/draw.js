// Draws a page's things by the shaders of the renderer: splats, what is seen of them, and light once a pixel.

const SHADINGS = ["none", "flat", "gouraud", "phong"];
const NEAR = 0.001; // share of the distance to what is looked at

// What is on the page -> { draw(view, lights, options) }. Throws an error where WebGL 2 cannot draw it.
async function createDrawing(canvas, data) {
  const gl = canvas.getContext("webgl2", { antialias: false, depth: false });
  if (!gl) throw new Error("no WebGL 2");
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no pictures of floats");
  const [texts, bytes] = await Promise.all([unpacked(data.shaders), unpacked(data.parts)]);
  const programs = new Programs(gl, JSON.parse(new TextDecoder().decode(texts)));
  const reader = new Reader(bytes), things = [];
  for (const head of data.things) things.push(await takePoints(gl, reader, head));
  return new Drawing(gl, programs, things, data);
}

// The points of a frame on the GPU.
async function takePoints(gl, reader, head) {
  const { width, height } = head;
  const { surface, kinds } = surfacePlane(reader, head);
  const colors = await takeColors(gl, reader, head, kinds);
  const thing = { ...head, surface: makeTexture(gl, "rgba32f", width, height, surface), colors };
  thing.known = makeIndices(gl, kinds, 1);
  if (head.hasRims) thing.rims = makeIndices(gl, kinds, 2);
  if (head.certainty) {
    const [columns, rows] = head.certainty, cells = reader.take(2 * columns * rows).slice();
    const certainty = Float32Array.from(new Uint16Array(cells.buffer), (value) => value / 65535);
    thing.certainty = makeTexture(gl, "r16f", columns, rows, certainty, gl.LINEAR);
  }
  if (head.size === null) {
    thing.sizes = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, thing.sizes);
    gl.bufferData(gl.ARRAY_BUFFER, reader.take(4 * width * height), gl.STATIC_DRAW);
  }
  return thing;
}

// Which pixels are drawn as points: their numbers, which gl_VertexID gives.
function makeIndices(gl, kinds, least) {
  const count = kinds.reduce((sum, kind) => sum + (kind >= least), 0), numbers = new Uint32Array(count);
  for (let k = 0, n = 0; k < kinds.length; ++k) if (kinds[k] >= least) numbers[n++] = k;
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
  return { buffer, count };
}

async function takeColors(gl, reader, head, kinds) {
  const { width, height, jpeg, ofPoints } = head.color;
  if (!jpeg) {
    const count = ofPoints ? head.count : width * height;
    return makeTexture(gl, "rgba8", width, height, colorPlanes(reader, width, height, ofPoints ? kinds : null, count));
  }
  const plain = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  const image = await createImageBitmap(new Blob([reader.take(jpeg)], { type: "image/jpeg" }), plain);
  const texture = makeTexture(gl, "rgba8", width, height);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
  return texture;
}

class Drawing {
  constructor(gl, programs, things, data) {
    Object.assign(this, { gl, programs, things, data, size: [0, 0], seen: "" });
    this.tables = {};
    const materials = things.map((thing) => thing.material);
    this.materials = makeTexture(gl, "rgba32f", 1, materials.length, new Float32Array(materials.flat()));
  }

  // view: { camera, pose }, the pose in home axes; lights with positions and directions there, too.
  // options: { shading, shadows }; a shading other than phong is for all things.
  draw(view, lights, options = {}) {
    const { camera, pose } = view, gl = this.gl;
    this.fit(camera.width, camera.height);
    const seen = JSON.stringify([camera, pose, options.shading]);
    if (seen !== this.seen) this.drawSurfaces(view, options);
    this.seen = seen;
    this.light(view, lights);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.picture);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    const [width, height] = this.size;
    gl.blitFramebuffer(0, 0, width, height, 0, height, width, 0, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null); // Chromium shows nothing after its canvas was resized while another was bound
  }

  // The last picture: RGBA bytes, top row first.
  read() {
    const gl = this.gl, [width, height] = this.size, pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }

  fit(width, height) {
    const gl = this.gl;
    if (this.size[0] === width && this.size[1] === height) return;
    for (const texture of this.textures || []) gl.deleteTexture(texture);
    for (const target of [this.splats, this.surfaces, this.picture]) gl.deleteFramebuffer(target || null);
    const make = (format) => makeTexture(gl, format, width, height);
    this.textures = ["r32i", "depth", "rgba32f", "rgba16f", "depth", "rgba8"].map(make);
    [this.ids, this.depth, this.surface, this.albedo, this.nearest, this.color] = this.textures;
    this.splats = makeTarget(gl, [this.ids], this.depth);
    this.surfaces = makeTarget(gl, [this.surface, this.albedo], this.nearest);
    this.picture = makeTarget(gl, [this.color]);
    this.size = [width, height];
    this.seen = "";
    gl.canvas.width = width;
    gl.canvas.height = height;
  }

  near(pose) {
    const { distance, bounds } = this.data;
    if (distance !== null) return NEAR * distance;
    const away = Math.hypot(...plus(bounds.centre, times(translation(pose), -1)));
    return NEAR * Math.max(away, bounds.radius);
  }

  drawSurfaces({ camera, pose }, { shading }) {
    const gl = this.gl, near = this.near(pose), size = this.size;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.surfaces);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    this.things.forEach((thing, k) => {
      const warp = this.warp(thing, camera, pose, near);
      this.drawSplats(this.splats, thing, warp, size);
      const own = shading && shading !== "phong" ? shading : thing.shading;
      const constants = { SHADING: SHADINGS.indexOf(own), CERTAINTY: thing.certainty ? 1 : 0 };
      this.fill(this.surfaces, size, "resolve_surfaces.frag", constants, {
        ...warp, scale: thing.scale, material_number: (k + 1) / 65535, source_ids: this.ids,
        window_depths: this.depth, depth_scale: warp.near, near, color_map: thing.colors, certainty_map: thing.certainty,
      });
    });
  }

  // The uniforms of a thing's way into a view.
  warp(thing, camera, pose, near) {
    const view = product(inverted(pose), thing.axes);
    for (let k = 0; k < 3; ++k) view[k][3] /= thing.scale;
    const target = [camera.fx, camera.fy, camera.cx, camera.cy];
    const target_size = [camera.width, camera.height];
    return { surface_map: thing.surface, source: thing.source, target, view, target_size, near: near / thing.scale, first_id: 1 };
  }

  // Which source pixel each pixel of a view shows.
  drawSplats(target, thing, warp, [width, height]) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, width, height);
    gl.clearBufferiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.enable(gl.DEPTH_TEST);
    const splats = this.programs.get("splats.vert", "splats.frag"), size = splats.attribute("size");
    splats.use({ ...warp, is_round: thing.isRound, has_rims: thing.hasRims });
    if (thing.sizes) {
      gl.bindBuffer(gl.ARRAY_BUFFER, thing.sizes);
      gl.enableVertexAttribArray(size);
      gl.vertexAttribPointer(size, 1, gl.FLOAT, false, 0, 0);
    } else gl.vertexAttrib1f(size, thing.size);
    this.drawPoints(thing.known);
    gl.disableVertexAttribArray(size);
    if (thing.rims) {
      this.programs.get("rims.vert", "rims.frag").use(warp);
      this.drawPoints(thing.rims);
    }
    gl.disable(gl.DEPTH_TEST);
  }

  drawPoints({ buffer, count }) {
    this.gl.bindBuffer(this.gl.ELEMENT_ARRAY_BUFFER, buffer);
    this.gl.drawElements(this.gl.POINTS, count, this.gl.UNSIGNED_INT, 0);
  }

  // Runs a fragment shader on all pixels of a target.
  fill(target, [width, height], fragment, constants, inputs, depthTest = true) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, width, height);
    this.programs.get("fullscreen.vert", fragment, constants).use(inputs);
    if (depthTest) gl.enable(gl.DEPTH_TEST);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.DEPTH_TEST);
  }

  light({ camera, pose }, lights) {
    const gl = this.gl, rows = lightRows(lights, pose);
    const alone = lights.length === 1;
    const inputs = {
      surface_map: this.surface, albedo_map: this.albedo, intrinsics: [camera.fx, camera.fy, camera.cx, camera.cy],
      eye: [0, 0, 0], ambient: this.data.ambient, light_count: lights.length,
      material: this.things[0].material, materials: this.materials,
    };
    if (alone) inputs.only_light = transposed([0, 4, 8, 12].map((k) => [...rows.subarray(k, k + 4)]));
    else inputs.lights = this.table("lights", rows, 5);
    const constants = {
      POINTS: 0, SHADOWS: 0, MATERIALS: this.things.length > 1 ? 1 : 0, LINEAR: 0, ALONE: alone ? 1 : 0,
      CERTAINTY: this.things.some((thing) => thing.certainty) ? 1 : 0,
    };
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    this.fill(this.picture, this.size, "light.frag", constants, inputs, false);
  }

  // A texture of rows of texels.
  table(name, rows, columns) {
    const gl = this.gl;
    gl.deleteTexture(this.tables[name] || null);
    return (this.tables[name] = makeTexture(gl, "rgba32f", columns, rows.length / 4 / columns, rows));
  }
}
