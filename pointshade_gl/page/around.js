// Light from all around: what hides it (gpu/shading/occlusion.py), and an environment
// (gpu/shading/light_set.py).

const SEARCHED = 80000; // for about so many pixels the planes are searched (visibility_stride)

// Radiance as spherical harmonics in other axes: turn takes these to the bands' own (estimation/environment_light.py).
function turnedBands(bands, turn) {
  const [c4, c5, c6, c7, c8] = bands.slice(4), channels = [0, 1, 2];
  const forms = channels.map((k) => {
    const form = [[c8[k] - c7[k], c4[k] / 2, c6[k] / 2], [c4[k] / 2, -c7[k] - c8[k], c5[k] / 2], [c6[k] / 2, c5[k] / 2, 2 * c7[k]]];
    return product(transposed(turn), product(form, turn));
  });
  const of = (pick) => forms.map(pick);
  return [
    bands[0], ...product(transposed(turn), bands.slice(1, 4)),
    of((m) => 2 * m[0][1]), of((m) => 2 * m[1][2]), of((m) => 2 * m[0][2]), of((m) => m[2][2] / 2), of((m) => (m[0][0] - m[1][1]) / 2),
  ];
}

// By how many pixels the planes that are searched are moved in a sample (gpu/shading/occlusion.py).
function planeShift(sample) {
  const spread = [0, 2, 1, 3];
  return [spread[Math.floor(sample / 4) % 4], spread[sample % 4]];
}

class Around {
  // around: { occlusion, bands, toSky, lobes }, in home axes; occlusion: the radius in world units, 0 for none.
  constructor(gl, painter, around) {
    Object.assign(this, { gl, painter, ...around });
    if (!this.lobes) return;
    const { width, height, texels } = this.lobes, bytes = Uint8Array.from(atob(texels), (one) => one.charCodeAt(0));
    this.lobeMap = makeTexture(gl, "rgba16f", width, height, new Uint16Array(bytes.buffer), gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.REPEAT);
  }

  get constants() {
    return { VISIBILITY: this.occlusion ? 1 : 0, ENVIRONMENT: this.bands ? (this.lobes ? 2 : 1) : 0 };
  }

  // What shaders/shading/around.glsl reads, for surfaces in these axes.
  inputs(axes, exposure) {
    const dark = Array(9).fill([0, 0, 0]), turn = rotation(axes);
    const bands = this.bands ? turnedBands(this.bands, turn).map((one) => times(one, exposure)) : dark;
    const [first_bands, second_bands, third_bands] = [0, 3, 6].map((k) => transposed(bands.slice(k, k + 3)));
    const found = { first_bands, second_bands, third_bands };
    if (!this.lobes) return found;
    const lobe_gain = exposure, lobes = this.lobes.count;
    return { ...found, lobe_map: this.lobeMap, lobe_gain, lobes, to_sky: product(this.toSky, turn) };
  }

  // What the points of a frame see of it, once.
  ofPoints(thing) {
    if (!this.occlusion) return null;
    if (!thing.visibility) {
      const { gl, painter } = this, { width, height, source, scale } = thing, surface = thing.normals ?? thing.surface;
      const found = this.search({ surface_map: surface, intrinsics: source, radius: this.radiusOf(thing) / scale }, width, height, {});
      thing.visibility = makeTexture(gl, "rgba8", width, height, null, gl.LINEAR);
      const target = makeTarget(gl, [thing.visibility]);
      painter.fill(target, [0, 0, width, height], "surface/visibility.frag", {}, found.inputs, false);
      found.free();
      gl.deleteFramebuffer(target);
    }
    return thing.visibility;
  }

  radiusOf(thing) {
    return this.occlusion === true ? thing.middle * thing.scale : this.occlusion;
  }

  // What hides light in a view of several things: { surface, albedo, visibility, size, intrinsics, distance, sample }.
  ofView({ surface, albedo, visibility, size, intrinsics, distance, sample }) {
    const { gl, painter } = this, radius = this.occlusion === true ? distance : this.occlusion;
    const own = { surface_map: surface, numbers_map: albedo, visibility_map: visibility, intrinsics, radius, shift: planeShift(sample) };
    const found = this.search(own, ...size, { OBJECTS: 1 });
    gl.deleteTexture(this.whole || null);
    this.whole = makeTexture(gl, "rgba32f", ...size);
    const target = makeTarget(gl, [this.whole]);
    painter.fill(target, [0, 0, ...size], "shading/view_visibility.frag", {}, found.inputs, false);
    found.free();
    gl.deleteFramebuffer(target);
    return this.whole;
  }

  // What is hidden from some pixels of a surface, and how to free it: { inputs, free }.
  search(own, width, height, constants) {
    const { gl, painter } = this, stride = Math.max(Math.round(Math.sqrt((width * height) / SEARCHED)), 1);
    const size = [width, height].map((side) => Math.ceil(side / stride)), inputs = { ...own, stride };
    const images = ["rgba32f", "r32f", "rgba32f", "rgba32f"].map((format) => makeTexture(gl, format, ...size));
    const [plane_map, weight_map, once, again] = images, box = [0, 0, ...size];
    const targets = [[plane_map, weight_map], [once], [again]].map((image) => makeTarget(gl, image));
    painter.fill(targets[0], box, "surface/hidden_in_plane.frag", constants, inputs, false);
    painter.fill(targets[1], box, "surface/mean_hidden.frag", {}, { ...inputs, plane_map, weight_map, first: -2 }, false);
    painter.fill(targets[2], box, "surface/mean_hidden.frag", { AGAIN: 1 }, { ...inputs, plane_map: once, first: -1 }, false);
    const free = () => {
      for (const texture of images) gl.deleteTexture(texture);
      for (const target of targets) gl.deleteFramebuffer(target);
    };
    return { inputs: { ...inputs, mean_map: again }, free };
  }
}
