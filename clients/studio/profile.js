// The light's path through the solid, as the model defines it: from the point p' under the surface towards the light, of
// which r is the length inside the solid. The server does this for every texel; here it is done for one, to be drawn.
// Plain arithmetic, no page.
//
// A solid is {width, height: texels, heights: Float32Array of 0 to 1, alpha: the same or null, relief, base: null for
// endless ground or the floor's z}. Lengths are in widths of the map: x to the right, y up, z towards the viewer.

const epsilon = 1e-9

/** The floor's z of a scene; null: endless ground. */
export const floorOf = ({ base, material }) => (base === 'none' ? null : base === 'auto' ? -material.depth : base)

const clamp = (number, low, high) => Math.min(Math.max(number, low), high)
const heightOf = (solid) => solid.height / solid.width

/** Height of the surface, bilinear between the centres of texels. */
export function surfaceAt(solid, x, y) {
  const { width, height, heights, relief } = solid
  const u = clamp(x * width - 0.5, 0, width - 1)
  const v = clamp(height - 0.5 - y * width, 0, height - 1)
  const i = Math.min(Math.floor(u), Math.max(width - 2, 0))
  const j = Math.min(Math.floor(v), Math.max(height - 2, 0))
  const at = j * width + i
  const right = width > 1 ? 1 : 0
  const down = height > 1 ? width : 0
  const upper = heights[at] + (heights[at + right] - heights[at]) * (u - i)
  const lower = heights[at + down] + (heights[at + down + right] - heights[at + down]) * (u - i)
  return relief * (upper + (lower - upper) * (v - j))
}

const isInside = ({ width, height }, x, y) => x >= 0 && x <= 1 && y >= 0 && y * width <= height

function isMaterial(solid, x, y) {
  if (!isInside(solid, x, y)) return false
  if (!solid.alpha) return true
  const i = clamp(Math.floor(x * solid.width), 0, solid.width - 1)
  const j = clamp(Math.floor(solid.height - y * solid.width), 0, solid.height - 1)
  return solid.alpha[j * solid.width + i] >= 0.5
}

/** Top of the solid; ground without floor is at 0 where there is no material, a panel is nowhere there. */
function topAt(solid, x, y) {
  if (isMaterial(solid, x, y)) return Math.max(surfaceAt(solid, x, y), solid.base == null ? 0 : -Infinity)
  return solid.base == null ? 0 : -Infinity
}

const isSolid = (solid, [x, y, z]) => z < topAt(solid, x, y) && (solid.base == null || z >= solid.base)

const unit = (v) => v.map((part) => part / Math.hypot(...v))

/** Middle of a texel on the surface. */
export function surfacePoint(solid, [i, j]) {
  const { width, height, heights, relief } = solid
  return [(i + 0.5) / width, (height - 0.5 - j) / width, relief * heights[j * width + i]]
}

/** Unit normal of a texel: central differences, one-sided at borders and masked texels. */
export function normalAt(solid, [i, j]) {
  const { width, height, heights, alpha, relief } = solid
  const z = (column, row) => relief * heights[row * width + column]
  const counts = (column, row) =>
    column >= 0 && row >= 0 && column < width && row < height && (!alpha || alpha[row * width + column] >= 0.5)
  const slope = (di, dj) => {
    const [before, after] = [counts(i - di, j - dj), counts(i + di, j + dj)]
    const from = before ? z(i - di, j - dj) : z(i, j)
    const to = after ? z(i + di, j + dj) : z(i, j)
    return before || after ? ((to - from) * width) / (before + after) : 0
  }
  return unit([-slope(1, 0), slope(0, 1), 1])
}

/** The point p' at which light is gathered. @param offset  'normal' or 'view' */
export function startOf(solid, texel, depth, offset) {
  const p = surfacePoint(solid, texel)
  const m = offset === 'view' ? [0, 0, 1] : normalAt(solid, texel)
  return p.map((part, axis) => part - depth * m[axis])
}

/** @return {direction: unit, distance, perhaps Infinity} from a point to a light, or null: an environment has no one ray. */
export function rayTo(solid, from, light) {
  if (light.type === 'environment') return null
  if (light.type === 'point') {
    const [x, y, z] = light.position
    const way = [x - from[0], y * heightOf(solid) - from[1], z - from[2]]
    const distance = Math.hypot(...way)
    return { direction: distance > epsilon ? way.map((part) => part / distance) : [0, 0, 1], distance }
  }
  if (light.direction) return { direction: unit(light.direction), distance: Infinity }
  const [azimuth, elevation] = [light.azimuth, light.elevation].map((degrees) => (degrees * Math.PI) / 180)
  const direction = [
    Math.sin(azimuth) * Math.cos(elevation),
    Math.cos(azimuth) * Math.cos(elevation),
    Math.sin(elevation),
  ]
  return { direction, distance: Infinity }
}

// How far along the ray anything but endless ground can be met.
function reach(solid, from, { direction, distance }) {
  const low = [0, 0, solid.base ?? -Infinity]
  const high = [1, heightOf(solid), Math.max(solid.relief, 0)]
  const ends = direction.map((part, axis) =>
    Math.abs(part) < epsilon ? Infinity : ((part > 0 ? high[axis] : low[axis]) - from[axis]) / part,
  )
  return Math.max(0, Math.min(distance, ...ends))
}

/**
 * The parts of a ray inside the solid, as [from, to] along it; the last one may end at Infinity.
 * The march has steps of an eighth of a texel, and finds each crossing between two of them by halving.
 */
export function insideParts(solid, from, ray) {
  const at = (s) => from.map((part, axis) => part + s * ray.direction[axis])
  const inside = (s) => isSolid(solid, at(s))
  const end = reach(solid, from, ray)
  const steps = Math.min(Math.max(Math.ceil(end * solid.width * 8), 1), 40000)
  const parts = []
  let open = inside(0) ? 0 : null
  for (let k = 1, before = 0; k <= steps; ++k) {
    const s = (end * k) / steps
    if (inside(s) !== (open != null)) {
      const crossing = halved(inside, before, s)
      if (open == null) open = crossing
      else {
        if (crossing > open) parts.push([open, crossing])
        open = null
      }
    }
    before = s
  }
  if (open == null && !(solid.base == null && at(end)[2] < 0)) return parts
  return [...parts, [open ?? end, lastEnd(solid, at, end, ray)]].filter(([a, b]) => b > a)
}

function halved(inside, low, high) {
  const first = inside(low)
  for (let i = 0; i < 24; ++i) {
    const middle = (low + high) / 2
    if (inside(middle) === first) low = middle
    else high = middle
  }
  return (low + high) / 2
}

// Beyond the map a panel has ended; endless ground is left at z = 0, or never.
function lastEnd(solid, at, end, { direction, distance }) {
  if (solid.base != null) return end
  const z = at(end)[2]
  if (z >= 0) return end
  return Math.min(distance, direction[2] > epsilon ? end - z / direction[2] : Infinity)
}

/** r: how long a ray is inside the solid. */
export const insideLength = (parts) => parts.reduce((sum, [from, to]) => sum + to - from, 0)

/** d of section 2 of the model, for `length` and `exponential`; null for `count`, which counts samples. */
export function illuminationOf(r, { illumination, depth, attenuation }) {
  if (illumination === 'count') return null
  if (illumination === 'exponential') return Math.exp(-attenuation * Math.max(0, r - depth))
  return r > 0 ? Math.min(1, depth / r) : 1
}

/**
 * V of the models of subsurface scattering: what of a light its way to the surface leaves, r being measured from the surface
 * itself. Not for `count`.
 */
export const visibilityOf = (r, { illumination, depth, attenuation }) =>
  illuminationOf(r, { illumination, attenuation, depth: illumination === 'exponential' ? 0 : depth })

/** Heights over a straight line of the map, `count` + 1 of them; where there is no material, null. */
export function profileAlong(solid, [x0, y0], [x1, y1], count) {
  return Array.from({ length: count + 1 }, (_, k) => {
    const [x, y] = [x0 + ((x1 - x0) * k) / count, y0 + ((y1 - y0) * k) / count]
    const top = topAt(solid, x, y)
    return top === -Infinity ? null : top
  })
}

/** Where a line of the map through a point leaves it, as [back, ahead] along the direction [dx, dy] (unit). */
export function borders(solid, [x, y], [dx, dy]) {
  const times = [
    [x, dx, 1],
    [y, dy, heightOf(solid)],
  ].flatMap(([at, by, end]) => (Math.abs(by) < epsilon ? [] : [[-at / by, (end - at) / by].sort((a, b) => a - b)]))
  return [Math.max(...times.map(([back]) => back)), Math.min(...times.map(([, ahead]) => ahead))]
}
