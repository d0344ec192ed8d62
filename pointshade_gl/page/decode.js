// Bytes -> pictures, as page/parts.py has made them.

async function unpacked(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Takes one part after the other from the unpacked bytes.
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  take(count) {
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }
}

// Of a pixel by those on its left (a), above (b) and before that (c).
function median(a, b, c) {
  if (c >= Math.max(a, b)) return Math.min(a, b);
  if (c <= Math.min(a, b)) return Math.max(a, b);
  return a + b - c;
}

// A plane: known pixels are predicted and corrected by error(n) of the n-th, others repeat what is before them.
function plane(width, height, known, error, mask = -1) {
  const values = new Int32Array(width * height);
  let n = 0;
  for (let y = 0, k = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x, ++k) {
      const a = x > 0 ? values[k - 1] : y > 0 ? values[k - width] : 0;
      if (known && known[k] === 0) {
        values[k] = a;
        continue;
      }
      const b = y > 0 ? values[k - width] : a;
      const guess = x > 0 && y > 0 ? median(a, b, values[k - width - 1]) : a;
      values[k] = (guess + error(n++)) & mask;
    }
  }
  return values;
}

// Whole numbers of `size` bytes for each of `count` known pixels.
function wholePlane(reader, width, height, known, count, size) {
  const bytes = reader.take(count * size);
  return plane(width, height, known, (n) => {
    let zigzag = bytes[n];
    for (let k = 1; k < size; ++k) zigzag |= bytes[k * count + n] << (8 * k);
    return zigzag & 1 ? -((zigzag + 1) >> 1) : zigzag >> 1;
  });
}

function colorPlanes(reader, width, height, known, count) {
  const [green, red, blue] = [0, 1, 2].map(() => {
    const bytes = reader.take(count);
    return plane(width, height, known, (n) => bytes[n], 255);
  });
  const colors = new Uint8Array(4 * width * height).fill(255);
  for (let k = 0; k < width * height; ++k) {
    colors[4 * k] = red[k] + green[k];
    colors[4 * k + 1] = green[k];
    colors[4 * k + 2] = blue[k] + green[k];
  }
  return colors;
}

// Of its place on an octahedron.
function unitVector(u, v) {
  const z = Math.abs(u) + Math.abs(v) - 1, inward = Math.max(z, 0);
  const x = u - (u >= 0 ? inward : -inward), y = v - (v >= 0 ? inward : -inward), length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

// Unit normal and depth of each pixel; depth 0 where nothing is known, negative at rims. The same with the normals for
// light, if those are others.
function surfacePlane(reader, part) {
  const { width, height, count } = part;
  const kinds = reader.take(width * height);
  const depths = wholePlane(reader, width, height, kinds, count, part.depthBytes);
  const planes = part.normalBytes.map((size) => wholePlane(reader, width, height, kinds, count, size));
  const scale = 2 / (2 ** part.normalBits - 1);
  const facing = (us, vs) => {
    const surface = new Float32Array(4 * width * height);
    for (let k = 0; k < width * height; ++k) {
      if (kinds[k] === 0) continue;
      const depth = part.nearest * Math.exp(depths[k] * part.depthStep);
      surface.set([...unitVector(us[k] * scale - 1, vs[k] * scale - 1), kinds[k] === 2 ? -depth : depth], 4 * k);
    }
    return surface;
  };
  return { surface: facing(planes[0], planes[1]), lit: planes.length > 2 ? facing(planes[2], planes[3]) : null, kinds };
}

// The points of a cloud as floats, in the order of POINT_LAYOUT, and their colours (page/parts.py).
function cloudPoints(reader, part) {
  const { count, discs, edges, low, step, smallest, sizeStep } = part, sizesOf = [...part.bytes];
  const isBorder = reader.take(discs), line = (known, length, stored) => wholePlane(reader, length, 1, known, stored, sizesOf.shift());
  const places = low.map(() => line(null, count, count)), sizes = part.hasSizes ? line(null, count, count) : null;
  const normals = [0, 1].map(() => line(null, discs, discs)), onward = [0, 1].map(() => line(isBorder, discs, edges));
  const vector = ([us, vs], k, bits) => unitVector(...[us, vs].map((plane) => (plane[k] * 2) / (2 ** bits - 1) - 1));
  const points = new Float32Array(POINT_FLOATS * count);
  for (let k = 0; k < count; ++k) {
    const at = POINT_FLOATS * k;
    for (let axis = 0; axis < 3; ++axis) points[at + axis] = low[axis] + step * places[axis][k];
    points[at + 3] = sizes ? smallest * Math.exp(sizes[k] * sizeStep) : 1;
    if (k < discs) points.set(vector(normals, k, part.normalBits), at + 4);
    if (k < discs && isBorder[k]) points.set(vector(onward, k, part.edgeBits), at + 7);
  }
  const colors = part.hasColors ? colorPlanes(reader, count, 1, null, count) : new Uint8Array(4 * count).fill(255);
  return { points, colors };
}
