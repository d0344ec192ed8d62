// Several frames of one thing, merged in each view: the nearest splat of all decides what is seen, and each frame that has
// that surface adds its part (gpu/points/point_objects.py, set_merge.py).

const SPARE = 153; // of 255, as in common/parts.glsl: trust in points that are not drawn, as another frame shows them better
const UNSURE = 127; // of 255: trust in points that only show where no others are

// Several frames of one thing, with how far each of their points is trusted, and where their rims end.
async function takeSet(gl, reader, head) {
  const views = [];
  for (const each of head.views) {
    const { kinds, ...view } = await takePoints(gl, reader, each), [known, rims] = [1, 2].map((least) => numbersOf(kinds, least));
    const [trust, cuts] = [0, 1].map(() => new Uint8Array(4 * kinds.length));
    for (const place of [0, 1]) reader.take(known.length).forEach((value, k) => (trust[4 * known[k] + place] = value));
    for (const number of rims) cuts.set(reader.take(4), 4 * number);
    const [trusts, ends] = [trust, cuts].map((bytes) => makeTexture(gl, "rgba8", view.width, view.height, bytes));
    const isDrawn = (number) => !head.isExact || trust[4 * number] !== SPARE;
    const drawn = head.isExact ? makeNumbers(gl, known.filter(isDrawn)) : view.known;
    const few = everySecond(kinds.map((kind, k) => kind && isDrawn(k) && trust[4 * k] > UNSURE), view.width);
    views.push({ ...view, trusts, ends, drawn, few: makeNumbers(gl, few), material: head.material });
  }
  return { ...head, views };
}

// How much each frame counts in a view, and the share of its splats that may hide those of others: `importances` and
// `primary_shares` in estimation/multi_view.py.
const BESIDE_ONE = 0.1, FAINT = 0.02, DISSOLVED = 0.8;

function importances(warps, isExact) {
  const away = warps.map(({ view }) => {
    const cosine = (view[0][0] + view[1][1] + view[2][2] - 1) / 2;
    return Math.acos(Math.min(Math.max(cosine, -1), 1)) + Math.hypot(view[0][3], view[1][3], view[2][3]);
  });
  const least = Math.min(...away), share = isExact ? Math.min(least / BESIDE_ONE, 1) : 1;
  const others = FAINT + (1 - FAINT) * share * share * (3 - 2 * share);
  return away.map((one) => (one === least ? 1 : others));
}

const primaryShare = (importance) => Math.max((importance - DISSOLVED) / (1 - DISSOLVED), 0);

class SetPainter {
  constructor(gl, painter, format) {
    Object.assign(this, { gl, painter, format });
  }

  // Draws a set among the surfaces of other things. ids, splats: of this view; visibilityOf: what the points of a frame
  // see of the light from all around, if something may hide it.
  *addSurface(target, size, thing, eye, { ids, splats }, { shading, material_number, visibilityOf }) {
    const { painter } = this, warps = yield* this.drawSplats(splats, thing, eye, thing.isExact), weights = importances(warps, thing.isExact);
    const maps = thing.views.map(visibilityOf), hasVisibility = Boolean(maps[0]);
    this.fit(size, hasVisibility);
    painter.clear(this.sums, this.textures.length);
    const SHADING = SHADINGS.indexOf(shading === "edl" ? "none" : shading);
    const constants = { EXACT: thing.isExact ? 1 : 0, VISIBILITY: hasVisibility ? 1 : 0, SHADING };
    const addUp = (view, k) => {
      const own = { light_map: view.lit, light_normals: view.normals, trust_map: view.trusts, color_map: view.colors, gain: view.gain };
      const CALM = view.normals && shading === "phong" ? 1 : 0, shared = { keys: ids, band: thing.band, importance: weights[k] };
      const inputs = { ...warps[k], ...own, ...shared, visibility_map: maps[k] };
      painter.fill(this.sums, [0, 0, ...size], "points/set_accumulate.frag", { ...constants, CALM }, inputs, false);
    };
    for (const [k, view] of thing.views.entries()) {
      painter.adding(true, () => addUp(view, k));
      yield;
    }
    const [geometry_map, albedo_map, visibility_map] = this.textures, { scale } = thing;
    const inputs = { geometry_map, albedo_map, visibility_map, keys: ids, near: eye.near, scale, material_number };
    painter.fill(target, [0, 0, ...size], "points/set_resolve.frag", { VISIBILITY: hasVisibility ? 1 : 0 }, inputs);
  }

  // Draws the depth of a set into a box of the shadow map. Lights see outlines that no frame has seen: they are whole.
  *addShadow(target, box, thing, eye, first, { ids, splats }) {
    yield* this.drawSplats(splats, thing, eye, false);
    const inputs = { keys: ids, near: eye.near / thing.scale, behind: thing.differ, first };
    this.painter.fill(target, box, "points/set_shadow.frag", {}, inputs);
  }

  // Draws a few points of a set as they are, into a box of a target: the surfaces of a picture, or a shadow map. number:
  // of their material.
  drawFew(target, box, thing, { camera, pose, near }, { number, is_lit, behind, visibilityOf }) {
    const { gl, painter } = this;
    painter.begin(target, box, true);
    for (const view of thing.views) {
      const visibility_map = visibilityOf(view), VISIBILITY = visibility_map ? 1 : 0;
      painter.programs.get("points/few_splats.vert", "points/few_splats.frag", { VISIBILITY }).use({
        ...warpOf(view, camera, pose, near), side: 2, scale: thing.scale, behind, is_lit, gain: view.gain, material_number: number,
        light_normals: view.normals ?? view.surface, color_map: view.colors, visibility_map,
      });
      painter.drawElements(gl.POINTS, view.few);
    }
  }

  // The keys of all splats in a view. Returns the ways into it.
  *drawSplats(target, thing, { camera, pose, near }, isExact) {
    const { gl, painter } = this, constants = { EXACT: isExact ? 1 : 0 };
    const warps = thing.views.map((view) => warpOf(view, camera, pose, near)), shares = importances(warps, isExact).map(primaryShare);
    painter.clearSplats(target, [0, 0, camera.width, camera.height]);
    for (const [k, view] of thing.views.entries()) {
      painter.begin(target, [0, 0, camera.width, camera.height], true);
      const inputs = { ...warps[k], is_round: view.isRound, has_rims: view.hasRims, side: view.size, trust_map: view.trusts, cuts_map: view.ends, primary: shares[k] };
      painter.programs.get("points/splats.vert", "points/set_splats.frag", constants).use(inputs);
      painter.drawElements(gl.POINTS, isExact ? view.drawn : view.known);
      if (view.rims) painter.drawRims(target, view, inputs, { ...constants, SET: 1 });
      yield;
    }
    return warps;
  }

  // Room for the sums of a view.
  fit(size, hasVisibility) {
    const gl = this.gl, sizes = `${size} ${hasVisibility}`;
    if (sizes === this.sizes) return;
    for (const texture of this.textures || []) gl.deleteTexture(texture);
    gl.deleteFramebuffer(this.sums || null);
    this.textures = Array.from({ length: hasVisibility ? 3 : 2 }, () => makeTexture(gl, this.format, ...size));
    this.sums = makeTarget(gl, this.textures);
    this.sizes = sizes;
  }
}
