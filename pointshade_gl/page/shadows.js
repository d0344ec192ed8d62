// The cameras of the pictures that lights take for their shadows (scene/shadow_cameras.py), and where those lie (gpu/shading/light_set.py).

const FAR_AWAY = 1000, NEAREST = 0.002; // radii of the scene
const NARROWEST = 1e-4; // radii of the scene, or distances
const SHADOW_SIDE = 1024, SHADOW_MAP = 8192; // pixels of a view, and of all of them side by side
const SHADOW_RIM = 2; // pixels round a view that stay empty
const WIDEST_VIEW = radians(70);
const TURNS = 3; // towards the middle of what is seen
const FACES = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const minus = (a, b) => a.map((x, k) => x - b[k]);

// The views that the lights take of what has this extent, and which are each light's; toWorld turns home axes. part: share
// of the radius of soft lights for which a sample stands. most: pixels of a view.
function shadowViews(lights, extent, toWorld, part, most = SHADOW_SIDE) {
  const looks = lights.map((one) => (one.shadow ? shadowDirections(one, extent, toWorld) : []));
  const count = looks.flat().length;
  const side = Math.min(most, Math.floor(SHADOW_MAP / Math.max(Math.ceil(Math.sqrt(count)), 1)));
  const views = [], spans = [];
  lights.forEach((one, k) => {
    spans.push(looks[k].length ? [views.length, looks[k].length] : null);
    for (const [direction, half] of looks[k]) views.push({ ...shadowEye(one, direction, half, extent, side, toWorld), spread: part * radiusOf(one, extent) });
  });
  const columns = Math.max(Math.ceil(Math.sqrt(count)), 1);
  views.forEach((view, k) => (view.first = [(k % columns) * side, Math.floor(k / columns) * side]));
  return { views, spans, side, size: [columns * side, Math.ceil(count / columns) * side] };
}

const layoutOf = ({ views, side, isCoarse }) => JSON.stringify([views.length, side, isCoarse]);

// The radius of a light as its views see it; of a rectangle that of a disc as large.
function radiusOf({ radius, angle, size }, extent) {
  if (size) return Math.sqrt((size[0] * size[1]) / Math.PI);
  return radius || FAR_AWAY * extent.radius * Math.tan(radians(angle) / 2);
}

// Where a light looks, and half the angle that it must see.
function shadowDirections({ position, direction, cone, size }, { corners, centre, radius }, toWorld) {
  if (!position) return [[unit(direction), 0]];
  const toCentre = minus(centre, position), away = Math.hypot(...toCentre), found = [];
  if (direction && !size) found.push([unit(direction), radians(cone[1])]);
  if (away > radius) found.push(narrowestView(position, times(toCentre, 1 / away), corners, toWorld));
  const narrow = found.filter(([, half]) => half <= WIDEST_VIEW).sort((a, b) => a[1] - b[1]);
  return narrow.length ? [narrow[0]] : FACES.map((face) => [applied(transposed(toWorld), face), Math.PI / 4]);
}

// Near this direction, the one to the middle of all corners, and half the angle that shows them.
function narrowestView(position, direction, corners, toWorld) {
  for (let k = 0; k < TURNS; ++k) {
    const [turn, ...places] = placesSeen(position, direction, corners, toWorld);
    const towards = places.map((values) => Math.tan(middleOf(values.map(Math.atan))));
    direction = unit(applied(turn, [...towards, 1]));
  }
  const [, x, y] = placesSeen(position, direction, corners, toWorld);
  return [direction, Math.atan(Math.max(...x.map(Math.abs), ...y.map(Math.abs), NARROWEST))];
}

// The turn of who looks in a direction, and where it sees the corners: x and y at depth 1.
function placesSeen(position, direction, corners, toWorld) {
  const turn = rotation(lookingAlong(position, direction, toWorld));
  const seen = corners.map((corner) => applied(transposed(turn), minus(corner, position)));
  return [turn, ...[0, 1].map((axis) => seen.map((at) => at[axis] / at[2]))];
}

const middleOf = (values) => (Math.min(...values) + Math.max(...values)) / 2;

function shadowEye({ position }, direction, half, { corners, centre, radius, contact, farther }, side, toWorld) {
  let place = position, focal = (side / 2 - SHADOW_RIM) / Math.tan(half);
  if (!position) {
    const away = FAR_AWAY * radius, turn = rotation(lookingAlong(centre, direction, toWorld));
    const seen = corners.map((corner) => applied(transposed(turn), minus(corner, centre)));
    const [x, y] = [0, 1].map((axis) => seen.map((at) => at[axis]));
    const reach = Math.max(Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y), 2 * NARROWEST * radius) / 2;
    place = plus(centre, applied(turn, [middleOf(x), middleOf(y), -away]));
    focal = ((side / 2 - SHADOW_RIM) * (away - radius)) / reach;
  }
  const near = Math.max(dot(minus(centre, place), direction) - 1.1 * radius, NEAREST * radius), middle = (side - 1) / 2;
  const camera = { fx: focal, fy: focal, cx: middle, cy: middle, width: side, height: side };
  return { camera, pose: lookingAlong(place, direction, toWorld), near, contact, farther };
}

// The pose of a camera that looks along a unit direction; similar directions give a similar roll.
function lookingAlong(place, direction, toWorld) {
  const z = applied(toWorld, direction);
  const x = unit(cross(z, Math.abs(z[0]) > 0.7 ? [0, 1, 0] : [1, 0, 0]));
  const turn = product(transposed(toWorld), transposed([x, cross(z, x), z]));
  return [...turn.map((row, k) => [...row, place[k]]), [0, 0, 0, 1]];
}

// Rows of 6 texels for each view, for points in axes with this pose.
function shadowRows(views, axes) {
  const rows = new Float32Array(24 * Math.max(views.length, 1));
  views.forEach(({ camera, pose, near, contact, farther, spread, first }, k) => {
    const way = product(inverted(pose), axes).slice(0, 3).flat();
    const seen = [camera.fx, camera.cx, ...first, near, camera.width, contact, spread * camera.fx];
    rows.set([...way, ...seen, ...product([farther], axes)[0]], 24 * k);
  });
  return rows;
}
