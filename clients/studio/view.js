// Zoom and pan: which part of the map the stage shows, and where. Plain arithmetic, no page.
//
// A view is {zoom, centre}: zoom 1 fits the whole map into the stage, `centre` is the place of the map in the stage's
// middle, [x, y] as shares of the map from its top left corner. Maps and stages are [width, height], in texels and CSS pixels.

const clamp = (number, low, high) => Math.min(Math.max(number, low), high)
const largestTexel = 24 // CSS pixels

export const wholeView = { zoom: 1, centre: [0.5, 0.5] }

const fit = (map, stage, margin) =>
  Math.max(Math.min((stage[0] - 2 * margin) / map[0], (stage[1] - 2 * margin) / map[1]), 0.01)

/** CSS pixels to a texel. */
const scaleOf = (view, map, stage, margin) => fit(map, stage, margin) * view.zoom

/**
 * @return  {region: [x, y, width, height] of the map in whole texels, or null for all of it,
 *           box: [left, top, width, height] of that in CSS pixels of the stage, scale}
 */
export function layoutOf(view, map, stage, margin) {
  const scale = scaleOf(view, map, stage, margin)
  const corner = [0, 1].map((axis) => stage[axis] / 2 - view.centre[axis] * map[axis] * scale)
  const from = [0, 1].map((axis) => clamp(Math.floor(-corner[axis] / scale), 0, map[axis] - 1))
  const to = [0, 1].map((axis) => clamp(Math.ceil((stage[axis] - corner[axis]) / scale), from[axis] + 1, map[axis]))
  const size = [to[0] - from[0], to[1] - from[1]]
  const all = size[0] === map[0] && size[1] === map[1]
  return {
    region: all ? null : [...from, ...size],
    box: [corner[0] + from[0] * scale, corner[1] + from[1] * scale, size[0] * scale, size[1] * scale],
    scale,
  }
}

/** The view whose centre is as near as it may be: a map larger than the stage covers it, a smaller one stays in its middle. */
function held({ zoom, centre }, map, stage, margin) {
  const scale = fit(map, stage, margin) * zoom
  const inside = (share, axis) => {
    const half = stage[axis] / 2 / (map[axis] * scale)
    return half >= 0.5 ? 0.5 : clamp(share, half, 1 - half)
  }
  return { zoom, centre: centre.map(inside) }
}

/** Nearer by a factor, with the place under `point` (of the stage) where it is. */
export function zoomed(view, map, stage, margin, point, factor) {
  const before = scaleOf(view, map, stage, margin)
  const nearest = Math.max(1, largestTexel / fit(map, stage, margin))
  const zoom = clamp(view.zoom * factor, 1, nearest)
  if (zoom === 1) return wholeView
  const after = scaleOf({ zoom }, map, stage, margin)
  const centre = [0, 1].map((axis) => {
    const from = point[axis] - stage[axis] / 2
    return view.centre[axis] + from / (map[axis] * before) - from / (map[axis] * after)
  })
  return held({ zoom, centre }, map, stage, margin)
}

/** The map follows the hand by [right, down] CSS pixels. */
export function panned(view, map, stage, margin, [right, down]) {
  const scale = scaleOf(view, map, stage, margin)
  const centre = [view.centre[0] - right / (map[0] * scale), view.centre[1] - down / (map[1] * scale)]
  return held({ zoom: view.zoom, centre }, map, stage, margin)
}

/** The texel under a point of the stage, held in the map. */
export function texelAt(view, map, stage, margin, point) {
  const scale = scaleOf(view, map, stage, margin)
  return [0, 1].map((axis) => {
    const texels = view.centre[axis] * map[axis] + (point[axis] - stage[axis] / 2) / scale
    return clamp(Math.floor(texels), 0, map[axis] - 1)
  })
}

/** The middle of a texel, in CSS pixels of the stage. */
export function pointOf(view, map, stage, margin, texel) {
  const scale = scaleOf(view, map, stage, margin)
  return [0, 1].map((axis) => stage[axis] / 2 + (texel[axis] + 0.5 - view.centre[axis] * map[axis]) * scale)
}
