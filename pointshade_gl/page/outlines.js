// Samples of one view differ in which points are seen only near outlines: elsewhere a pixel's point is kept, as its
// surface goes on beyond it, and only what may be seen near outlines is drawn again.

class Outlines {
  constructor(gl, painter) {
    Object.assign(this, { gl, painter, numbers: gl.createBuffer() });
  }

  // Notes what is seen in a view of a frame's points that was drawn to a target just now, of these textures.
  note(target, { ids, depth, size }, thing, warp) {
    const { gl, painter } = this, [width, height] = size, all = [thing.width, thing.height], { isRound } = thing;
    this.fit(size, all);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, target);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.target);
    for (const part of [gl.COLOR_BUFFER_BIT, gl.DEPTH_BUFFER_BIT]) gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, part, gl.NEAREST);
    const { insides } = this;
    painter.fill(this.insideTarget, [0, 0, ...size], "points/view_insides.frag", {}, { ...warp, source_ids: ids, window_depths: depth }, false);
    painter.fill(this.chosenTarget, [0, 0, ...all], "points/outline_points.frag", {}, { ...warp, insides, size: thing.size, is_round: isRound }, false);
    const chosen = new Uint8Array(4 * all[0] * all[1]);
    gl.readPixels(0, 0, ...all, gl.RGBA, gl.UNSIGNED_BYTE, chosen);
    const numbers = new Uint32Array(all[0] * all[1]);
    let count = 0;
    for (let k = 0; k < numbers.length; ++k) if (chosen[4 * k]) numbers[count++] = k;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.numbers);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, numbers.subarray(0, count), gl.DYNAMIC_DRAW);
    return { known: { buffer: this.numbers, count }, inputs: { insides, kept_ids: this.ids, kept_depths: this.depth } };
  }

  fit(size, all) {
    const gl = this.gl, sizes = `${size} ${all}`;
    if (sizes === this.sizes) return;
    for (const texture of [this.ids, this.depth, this.insides, this.chosen]) gl.deleteTexture(texture || null);
    for (const target of [this.target, this.insideTarget, this.chosenTarget]) gl.deleteFramebuffer(target || null);
    [this.ids, this.depth, this.insides] = ["r32i", "depth", "rgba8"].map((format) => makeTexture(gl, format, ...size));
    this.chosen = makeTexture(gl, "rgba8", ...all);
    this.target = makeTarget(gl, [this.ids], this.depth);
    [this.insideTarget, this.chosenTarget] = [this.insides, this.chosen].map((texture) => makeTarget(gl, [texture]));
    this.sizes = sizes;
  }
}
