// One way to draw each kind of thing, by the shaders of the renderer.

const SHADINGS = ["none", "flat", "gouraud", "phong", "edl"];
const LIT_EARLY = ["flat", "gouraud"]; // of these: light points or corners, and mix that light
const RIMS_A_ROW = 256; // of those that are known
const KNOWN_RIMS = ["known_heads", "known_outlines", "known_slopes", "known_folds"]; // of points/rims.vert
const CORNERS = { position: [3, 0], normal: [3, 12], uv: [2, 24], lit_at: [3, 32] }; // of meshes: numbers, first byte

// The uniforms of a thing's way into a view. Points have a unit of their own, `scale` of the world's.
function warpOf({ axes, surface, source, scale }, camera, pose, near) {
  const view = product(inverted(pose), axes);
  for (let k = 0; k < 3; ++k) view[k][3] /= scale;
  const target = [camera.fx, camera.fy, camera.cx, camera.cy], target_size = [camera.width, camera.height];
  return { surface_map: surface, source, target, view, target_size, near: near / scale, first_id: 1 };
}

// What turns normals: the inverse of the view's transpose.
function normalView(view) {
  const [a, b, c] = rotation(view), cofactors = [cross(b, c), cross(c, a), cross(a, b)];
  return cofactors.map((row) => times(row, 1 / dot(a, cofactors[0])));
}

class Painter {
  constructor(gl, programs) {
    Object.assign(this, { gl, programs, tables: {} });
  }

  // From now on a box (left, top, width, height) of a target is drawn to, the nearest stays.
  begin(target, [left, top, width, height], depthTest) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(left, top, width, height);
    if (depthTest) gl.enable(gl.DEPTH_TEST);
    else gl.disable(gl.DEPTH_TEST);
  }

  clear(target, textures = 1) {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, target);
    for (let k = 0; k < textures; ++k) this.gl.clearBufferfv(this.gl.COLOR, k, [0, 0, 0, 0]);
  }

  clearSplats(target, box) {
    this.begin(target, box, true);
    this.gl.clearBufferiv(this.gl.COLOR, 0, [0, 0, 0, 0]);
    this.gl.clearBufferfv(this.gl.DEPTH, 0, [1]);
  }

  // What is drawn meanwhile is added to what is there, if so asked.
  adding(isAdded, draw) {
    const gl = this.gl;
    if (isAdded) gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    draw();
    gl.disable(gl.BLEND);
  }

  // Runs a fragment shader on all pixels of a box.
  fill(target, box, fragment, constants, inputs, depthTest = true) {
    this.begin(target, box, depthTest);
    this.programs.get("fullscreen.vert", fragment, constants).use(inputs);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }

  // Which source pixel each pixel of a view shows. kept: what is known of it (outlines.js).
  drawSplats(target, thing, warp, kept = null) {
    const gl = this.gl;
    this.clearSplats(target, [0, 0, ...warp.target_size]);
    if (kept) this.fill(target, [0, 0, ...warp.target_size], "points/kept_points.frag", {}, kept.inputs);
    const splats = this.programs.get("points/splats.vert", "points/splats.frag"), size = splats.attribute("size");
    splats.use({ ...warp, is_round: thing.isRound, has_rims: thing.hasRims });
    if (thing.sizes) {
      gl.bindBuffer(gl.ARRAY_BUFFER, thing.sizes);
      gl.enableVertexAttribArray(size);
      gl.vertexAttribPointer(size, 1, gl.FLOAT, false, 0, 0);
    } else gl.vertexAttrib1f(size, thing.size);
    this.drawElements(gl.POINTS, kept ? kept.known : thing.known);
    gl.disableVertexAttribArray(size);
    if (thing.rims) this.drawRims(target, thing, warp);
  }

  // Those of a film are soon over, and estimated where they are drawn.
  drawRims(target, thing, inputs, constants = {}) {
    const { gl } = this, { rims } = thing, KNOWN = thing.isFilm ? 0 : 1;
    if (KNOWN && !rims.known) this.estimateRims(thing);
    this.begin(target, [0, 0, ...inputs.target_size], true);
    this.programs.get("points/rims.vert", "points/rims.frag", { ...constants, KNOWN }).use({ ...inputs, ...rims.known });
    if (KNOWN) gl.drawArrays(gl.POINTS, 0, rims.count);
    else this.drawElements(gl.POINTS, rims);
  }

  // What rims are in their frame, once for all views.
  estimateRims({ surface, source, rims }) {
    const { gl } = this, size = [RIMS_A_ROW, Math.max(Math.ceil(rims.count / RIMS_A_ROW), 1)], list = new Int32Array(size[0] * size[1]);
    list.set(rims.list);
    const numbers = makeTexture(gl, "r32i", ...size, list), maps = KNOWN_RIMS.map(() => makeTexture(gl, "rgba32f", ...size));
    const target = makeTarget(gl, maps);
    this.fill(target, [0, 0, ...size], "points/known_rims.frag", {}, { surface_map: surface, numbers, source }, false);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(numbers);
    rims.known = Object.fromEntries(KNOWN_RIMS.map((name, k) => [name, maps[k]]));
    rims.list = null;
  }

  drawMesh(target, box, vertex, fragment, thing, inputs) {
    const gl = this.gl;
    this.begin(target, box, true);
    const program = this.programs.get(vertex, fragment);
    program.use(inputs);
    gl.bindBuffer(gl.ARRAY_BUFFER, thing.corners);
    const used = Object.entries(CORNERS).map(([name, layout]) => [program.attribute(name), ...layout]);
    const places = used.filter(([place]) => place >= 0);
    for (const [place, numbers, first] of places) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, numbers, gl.FLOAT, false, 44, first);
    }
    const tint = program.attribute("tint");
    if (tint >= 0 && thing.tints) {
      gl.bindBuffer(gl.ARRAY_BUFFER, thing.tints);
      gl.enableVertexAttribArray(tint);
      gl.vertexAttribPointer(tint, 3, gl.FLOAT, false, 12, 0);
      places.push([tint]);
    } else if (tint >= 0) gl.vertexAttrib3f(tint, 0, 0, 0);
    this.drawElements(gl.TRIANGLES, thing.faces);
    for (const [place] of places) gl.disableVertexAttribArray(place);
  }

  drawElements(kind, { buffer, count }) {
    this.gl.bindBuffer(this.gl.ELEMENT_ARRAY_BUFFER, buffer);
    this.gl.drawElements(kind, count, this.gl.UNSIGNED_INT, 0);
  }

  // A texture of rows of so many texels.
  table(name, rows, texels = 5) {
    this.gl.deleteTexture(this.tables[name] || null);
    return (this.tables[name] = makeTexture(this.gl, "rgba32f", texels, rows.length / (4 * texels), rows));
  }
}
