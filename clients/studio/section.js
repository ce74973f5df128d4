// The cross-section: the relief cut along the light's ray through a chosen texel, with the ray and the part of it inside the
// solid, whose length is r. It teaches the integrated model: what lengthens the thick line darkens the texel. With a model of
// subsurface scattering the line begins on the surface itself, and tells what of the light enters there.
import { isTranslucent } from './models.js'
import { decodePng } from './png.js'
import {
  borders,
  floorOf,
  illuminationOf,
  insideLength,
  insideParts,
  normalAt,
  profileAlong,
  rayTo,
  startOf,
  surfacePoint,
  visibilityOf,
} from './profile.js'
import { pointOf, texelAt } from './view.js'

const svg = 'http://www.w3.org/2000/svg'
const widest = 2048 // texels of a map that is cut exactly; a larger one is cut at this size
const samples = 480 // of the drawn profile

/** Heights and mask of the scene's map, as numbers. Kept until the map or the mask is another. */
function solidSource(client) {
  let key = null
  let parts = null
  const layer = async (scene, name, width, bitDepth) => {
    const output = { layer: name, format: 'png', bitDepth, width }
    const { blob } = await client.render({ height: scene.height, alpha: scene.alpha, output })
    return decodePng(await blob.arrayBuffer())
  }
  return (scene, map) => {
    const wanted = JSON.stringify([scene.height, scene.alpha])
    if (wanted !== key) {
      key = wanted
      const width = map.width > widest ? widest : null
      parts = Promise.all([layer(scene, 'height', width, 16), layer(scene, 'alpha', width, 8)])
      parts.catch(() => (key = null))
    }
    return parts
  }
}

/** What is drawn and said of one texel of a solid under one light; all lengths in widths of the map. */
function cutThrough(solid, texel, light, scene) {
  const { material } = scene
  const p = surfacePoint(solid, texel)
  const start = isTranslucent(scene) ? p : startOf(solid, texel, material.depth, material.offset)
  const ray = rayTo(solid, start, light)
  if (!ray) return { p, start, ray: null, along: [1, 0] }
  const flat = Math.hypot(ray.direction[0], ray.direction[1])
  const along = flat > 1e-6 ? [ray.direction[0] / flat, ray.direction[1] / flat] : [1, 0]
  const parts = insideParts(solid, start, ray)
  const r = insideLength(parts)
  if (!isTranslucent(scene)) return { p, start, ray, along, parts, r, d: illuminationOf(r, material) }
  const cosine = normalAt(solid, texel).reduce((sum, part, axis) => sum + part * ray.direction[axis], 0)
  return { p, start, ray, along, parts, r, cosine: Math.max(0, cosine), visibility: visibilityOf(r, material) }
}

const path = (points) => points.map(([x, y], i) => `${i ? 'L' : 'M'}${x.toFixed(1)} ${y.toFixed(1)}`).join('')

/** @return {show} */
export function bindSection(store, client, stage, fail) {
  const { ui } = store
  const drawer = document.getElementById('section')
  const plot = document.getElementById('plot')
  const words = document.getElementById('cut')
  const probe = document.getElementById('probe')
  const source = solidSource(client)
  const shapes = Object.fromEntries(
    ['ground', 'surface', 'ray', 'inside', 'offset', 'point', 'start', 'lamp'].map((name) => {
      const kind = ['point', 'start', 'lamp'].includes(name) ? 'circle' : 'path'
      const shape = document.createElementNS(svg, kind)
      shape.setAttribute('class', name)
      if (kind === 'circle') shape.setAttribute('r', name === 'lamp' ? 6 : 3.5)
      plot.append(shape)
      return [name, shape]
    }),
  )
  const put = (shape, [x, y]) => {
    shape.setAttribute('cx', x.toFixed(1))
    shape.setAttribute('cy', y.toFixed(1))
  }

  async function show() {
    drawer.hidden = probe.hidden = !ui.section
    document.getElementById('cut-toggle').setAttribute('aria-pressed', String(ui.section))
    if (!ui.section || !store.map) return
    ui.probe ??= [Math.floor(store.map.width * 0.5), Math.floor(store.map.height * 0.42)]
    const [x, y] = pointOf(...stage.geometry(), ui.probe)
    probe.style.translate = `${x}px ${y}px`
    probe.setAttribute('aria-valuenow', ui.probe[0])
    probe.setAttribute('aria-valuemax', store.map.width - 1)
    probe.setAttribute('aria-valuetext', `texel ${ui.probe[0]} from the left, ${ui.probe[1]} from the top`)
    try {
      const { scene, map } = store
      const [heights, mask] = await source(scene, map)
      if (scene === store.scene && ui.section) draw(heights, mask)
    } catch (error) {
      fail(error)
    }
  }

  function draw(heights, mask) {
    const { scene, map } = store
    const light = scene.lights[ui.active]
    const solid = {
      width: heights.width,
      height: heights.height,
      heights: heights.numbers,
      alpha: mask.numbers,
      relief: scene.relief,
      base: floorOf(scene),
    }
    const texel = ui.probe.map((at, axis) =>
      Math.min(Math.floor((at * heights.width) / map.width), [heights.width, heights.height][axis] - 1),
    )
    const cut = cutThrough(solid, texel, light, scene)
    drawCut(solid, cut, light)
    plot.setAttribute('aria-label', say(cut, scene))
    document.getElementById('cut-means').textContent = isTranslucent(scene)
      ? 'V of the light comes to the surface; where it comes out of it again is the model’s matter.'
      : 'Move the ring on the picture, or Alt+click.'
  }

  function drawCut(solid, cut, light) {
    const box = [plot.clientWidth, plot.clientHeight]
    plot.setAttribute('viewBox', `0 0 ${box[0]} ${box[1]}`)
    const [x, y] = cut.start
    const [back, ahead] = borders(solid, [x, y], cut.along)
    const at = (s) => [x + s * cut.along[0], y + s * cut.along[1]]
    const heights = profileAlong(solid, at(back), at(ahead), samples)
    const flatTo = (s) => s * (cut.ray ? Math.hypot(cut.ray.direction[0], cut.ray.direction[1]) : 0)
    const lamp = cut.ray && Number.isFinite(cut.ray.distance) ? cut.ray.distance : Infinity
    const top = Math.max(...heights.filter((z) => z != null), 0.02, cut.p[2])
    const floor = Math.min(0, solid.base ?? -0.02, cut.start[2])
    const low = floor - 0.1 * (top - floor)
    const high = top + 0.45 * (top - low)
    const sx = (s) => 12 + ((s - back) / (ahead - back)) * (box[0] - 24)
    const sz = (z) => box[1] - 6 - ((z - low) / (high - low)) * (box[1] - 12)
    const step = (ahead - back) / samples
    document.getElementById('stretch').textContent = `heights × ${((sz(0) - sz(1)) / (sx(1) - sx(0))).toFixed(1)}`
    const line = heights.map((z, k) => [sx(back + k * step), sz(z ?? floor)])
    shapes.surface.setAttribute('d', path(line))
    const bottom = solid.base == null ? box[1] : sz(solid.base)
    shapes.ground.setAttribute('d', `${path([...line, [line.at(-1)[0], bottom], [line[0][0], bottom]])}Z`)
    put(shapes.point, [sx((cut.p[0] - x) * cut.along[0] + (cut.p[1] - y) * cut.along[1]), sz(cut.p[2])])
    put(shapes.start, [sx(0), sz(cut.start[2])])
    shapes.offset.setAttribute(
      'd',
      path([
        [+shapes.point.getAttribute('cx'), +shapes.point.getAttribute('cy')],
        [sx(0), sz(cut.start[2])],
      ]),
    )
    for (const name of ['ray', 'inside', 'lamp']) shapes[name].toggleAttribute('hidden', !cut.ray)
    if (!cut.ray) return
    const place = (s) => [sx(flatTo(s)), sz(cut.start[2] + s * cut.ray.direction[2])]
    const end = Math.min(lamp, 4)
    shapes.ray.setAttribute('d', path([place(0), place(end)]))
    shapes.inside.setAttribute('d', cut.parts.map(([a, b]) => path([place(a), place(Math.min(b, end))])).join(''))
    put(shapes.lamp, place(end))
    shapes.lamp.toggleAttribute('hidden', !Number.isFinite(lamp))
    shapes.lamp.style.setProperty('--colour', typeof light.color === 'string' ? light.color : 'currentColor')
  }

  const figures = (number) => (Number.isFinite(number) ? number.toPrecision(3) : '∞')
  const formulas = {
    length: 'd = min(1, t / r)',
    exponential: 'd = exp(−a (r − t))',
    count: 'd = 1 / samples inside',
  }
  const visibilities = { length: 'V = min(1, t / r)', exponential: 'V = exp(−a r)' }

  function say(cut, scene) {
    const { illumination, depth, attenuation } = scene.material
    if (!cut.ray) {
      words.textContent = 'Surroundings light from everywhere: take a point or a sun to see its ray.'
      return words.textContent
    }
    const result = (number) => (number == null ? '' : ` = ${number.toFixed(3)}`)
    const absorption = illumination === 'exponential' ? [`a = ${attenuation}`] : []
    const ends = isTranslucent(scene)
      ? [visibilities[illumination] + result(cut.visibility), `cos${result(cut.cosine)}`]
      : [formulas[illumination] + result(cut.d)]
    words.textContent = [`r = ${figures(cut.r)}`, `t = ${figures(depth)}`, ...absorption, ...ends].join('   ')
    return `Cross-section under the light's ray: ${words.textContent}`
  }

  // ---- the hand on the probe

  const toTexel = (event) => store.set({ probe: texelAt(...stage.geometry(), stage.pointOf(event)) })
  probe.addEventListener('pointerdown', (event) => {
    probe.setPointerCapture(event.pointerId)
    probe.focus()
    event.preventDefault()
  })
  probe.addEventListener('pointermove', (event) => probe.hasPointerCapture(event.pointerId) && toTexel(event))
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }
  probe.addEventListener('keydown', (event) => {
    if (!arrows[event.key]) return
    event.preventDefault()
    const step = event.shiftKey ? 20 : 2
    const limits = [store.map.width - 1, store.map.height - 1]
    store.set({
      probe: ui.probe.map((at, axis) => Math.min(Math.max(at + arrows[event.key][axis] * step, 0), limits[axis])),
    })
  })
  document.getElementById('stage').addEventListener(
    'pointerdown',
    (event) => {
      if (!ui.section || !event.altKey || event.button) return
      event.preventDefault()
      event.stopPropagation()
      toTexel(event)
    },
    { capture: true },
  )
  new ResizeObserver(show).observe(plot)
  return { show }
}
