// The stage: the picture whose light is dragged, zoom and pan, the lights that are not in hand, and before beside after.
import { handlePosition } from '../relit.js'
import { hexColour, isBehind, shownScene, withMember } from './scene.js'
import { layoutOf, panned, wholeView, zoomed } from './view.js'
import { make } from './widgets.js'

const margin = () => (innerWidth < 760 ? 14 : 30) // CSS pixels round the whole picture
const clamp = (number, low, high) => Math.min(Math.max(number, low), high)

/**
 * @param picture, before  <relit-image>; `before` shows the scene that is compared with, and takes no hand
 * @return {show, size, layout, point}
 */
export function bindStage(store, stage, picture, before) {
  const { ui } = store
  let shown = null // region of the picture on the screen
  const size = () => [stage.clientWidth, stage.clientHeight]
  const texels = () => [store.map.width, store.map.height]
  const layout = () => layoutOf(ui.view, texels(), size(), margin())

  /** Where things of the whole map are, for what is laid over the picture. */
  const geometry = () => [ui.view, texels(), size(), margin()]

  const place = (element, [left, top, width, height]) => {
    Object.assign(element.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` })
  }

  // Until the picture of a new region is there, the old one is moved and stretched to where it belongs.
  function slide({ region, box, scale }) {
    const [x, y, w, h] = shown ?? [0, 0, ...texels()]
    const [x0, y0] = region ?? [0, 0]
    const moved = `translate(${(x - x0) * scale}px, ${(y - y0) * scale}px)`
    picture.style.setProperty('--slide', `${moved} scale(${(w * scale) / box[2]}, ${(h * scale) / box[3]})`)
  }

  function show(by) {
    if (!store.scene || !store.map) return
    const now = layout()
    place(picture, now.box)
    slide(now)
    picture.active = ui.solo == null ? ui.active : 0
    if (by !== 'hand') give(picture, shownScene(store.scene, { solo: ui.solo, region: now.region }))
    picture.classList.toggle('behind', isBehind(store.scene.lights[ui.active]))
    before.hidden = !ui.compare
    if (ui.compare) {
      place(before, now.box)
      give(before, { ...ui.compare.scene, output: { ...ui.compare.scene.output, region: now.region } })
    }
    showOthers(now)
    showDome(now)
    showDivider()
    document.getElementById('zoom').textContent = `${Math.round(now.scale * devicePixelRatio * 100)} %`
    document.getElementById('fit').disabled = ui.view.zoom === 1
    document.getElementById('smaller').disabled = ui.view.zoom === 1
  }

  // The element renders what it is given, so it is given only what is new.
  const given = new Map()
  function give(element, scene) {
    const text = JSON.stringify(scene)
    if (given.get(element) === text) return
    given.set(element, text)
    element.scene = scene
  }

  picture.addEventListener('relit-light', ({ detail }) => {
    const index = ui.solo ?? detail.index
    const before = store.scene
    given.set(picture, JSON.stringify(detail.scene))
    if (before.lights[index]?.type !== detail.light.type) return
    store.change(withMember(before, `lights.${index}`, detail.light), 'hand', 'hand')
    if (detail.rest) store.settle()
  })
  picture.addEventListener('relit-frame', ({ detail }) => {
    shown = detail.scene.output?.region ?? null
    if (store.map) slide(layout())
  })

  /** The horizon of the sun in hand: outside of it is behind. */
  function showDome({ box }) {
    const dome = document.getElementById('dome')
    dome.hidden = store.scene.lights[ui.active].type !== 'directional'
    const across = Math.min(box[2], box[3])
    place(dome, [box[0] + (box[2] - across) / 2, box[1] + (box[3] - across) / 2, across, across])
  }

  // ---- the other lights

  const others = document.getElementById('others')
  function showOthers({ region, box }) {
    const crop = (region ?? [0, 0, ...texels()]).map((part, i) => part / texels()[i % 2])
    const lights = ui.solo == null ? store.scene.lights : []
    const dots = lights.flatMap((light, i) => {
      if (i === ui.active || light.type === 'environment') return []
      const [x, y] = handlePosition(light, [box[2], box[3]], crop)
      const at = [clamp(box[0] + x, 8, size()[0] - 8), clamp(box[1] + y, 8, size()[1] - 8)]
      const dot = make('button', {
        type: 'button',
        className: isBehind(light) ? 'other behind' : 'other',
        'aria-label': `Take light ${i + 1} in hand`,
        'data-tip': `Light ${i + 1}`,
      })
      dot.style.translate = `${at[0]}px ${at[1]}px`
      dot.style.setProperty('--colour', hexColour(light.color))
      dot.addEventListener('click', () => store.set({ active: i }))
      return [dot]
    })
    others.replaceChildren(...dots)
  }

  // ---- zoom and pan

  const look = (view) => store.set({ view })
  const zoomAt = (point, factor) => store.map && look(zoomed(...geometry(), point, factor))
  const middle = () => size().map((length) => length / 2)
  const pointOf = (event) => {
    const box = stage.getBoundingClientRect()
    return [event.clientX - box.left, event.clientY - box.top]
  }
  stage.addEventListener(
    'wheel',
    (event) => {
      if (!store.map) return
      event.preventDefault()
      if (event.shiftKey) look(panned(...geometry(), [-event.deltaY - event.deltaX, 0]))
      else zoomAt(pointOf(event), 2 ** (-event.deltaY * (event.deltaMode ? 20 : 1) * (event.ctrlKey ? 0.01 : 0.002)))
    },
    { passive: false },
  )

  let spaced = false
  let hold = null // {kind: 'pan', id, at} or {kind: 'pinch', points: Map}
  const touches = new Map()
  addEventListener('keydown', (event) => {
    if (event.key !== ' ' || event.target.closest('input, button, select, textarea, summary, dialog, a')) return
    spaced = true
    stage.classList.add('grab')
    event.preventDefault()
  })
  addEventListener('keyup', (event) => {
    if (event.key !== ' ') return
    spaced = false
    stage.classList.remove('grab')
  })
  const onControl = (event) => event.target.closest?.('.over, .other, #probe, #divider, #notice, #hint')
  stage.addEventListener(
    'pointerdown',
    (event) => {
      if (!store.map || onControl(event)) return
      if (event.pointerType === 'touch') {
        touches.set(event.pointerId, pointOf(event))
        if (touches.size === 2) return beginPinch(event)
      }
      const outside = event.target === stage
      if (event.button === 1 || (event.button === 0 && (spaced || (outside && ui.view.zoom > 1)))) {
        hold = { kind: 'pan', id: event.pointerId, at: pointOf(event) }
        stage.setPointerCapture(event.pointerId)
        event.preventDefault()
        event.stopPropagation()
      }
    },
    { capture: true },
  )

  // The first finger had begun to move the light: that is taken back.
  function beginPinch(event) {
    hold = { kind: 'pinch' }
    for (const id of touches.keys()) stage.setPointerCapture(id)
    if (touches.light) store.change(touches.light, 'hand')
    event.preventDefault()
    event.stopPropagation()
  }
  stage.addEventListener('pointerdown', () => touches.size === 1 && (touches.light = store.scene), { capture: true })
  stage.addEventListener('pointermove', (event) => {
    const at = pointOf(event)
    if (hold?.kind === 'pan' && event.pointerId === hold.id) {
      look(panned(...geometry(), [at[0] - hold.at[0], at[1] - hold.at[1]]))
      hold.at = at
    } else if (hold?.kind === 'pinch' && touches.has(event.pointerId) && touches.size === 2) {
      const was = spread([...touches.values()])
      touches.set(event.pointerId, at)
      const is = spread([...touches.values()])
      const view = zoomed(...geometry(), was.middle, is.distance / Math.max(was.distance, 1))
      look(panned(view, texels(), size(), margin(), [is.middle[0] - was.middle[0], is.middle[1] - was.middle[1]]))
    }
  })
  const spread = ([a, b]) => ({
    middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2],
    distance: Math.hypot(a[0] - b[0], a[1] - b[1]),
  })
  const release = (event) => {
    touches.delete(event.pointerId)
    if (hold?.kind === 'pan' && event.pointerId === hold.id) hold = null
    if (hold?.kind === 'pinch' && !touches.size) hold = null
  }
  stage.addEventListener('pointerup', release)
  stage.addEventListener('pointercancel', release)
  document.getElementById('larger').addEventListener('click', () => zoomAt(middle(), Math.SQRT2))
  document.getElementById('smaller').addEventListener('click', () => zoomAt(middle(), Math.SQRT1_2))
  document.getElementById('fit').addEventListener('click', () => look(wholeView))

  // ---- before and after

  const divider = document.getElementById('divider')
  function showDivider() {
    divider.hidden = document.getElementById('sides').hidden = !ui.compare
    document.getElementById('compare').setAttribute('aria-pressed', String(!!ui.compare))
    picture.style.setProperty('--after', ui.compare ? `inset(0 0 0 ${ui.compare.at * 100}%)` : 'none')
    if (!ui.compare) return
    const { box } = layout()
    const x = box[0] + ui.compare.at * box[2]
    divider.style.translate = `${x}px 0`
    divider.setAttribute('aria-valuenow', Math.round(ui.compare.at * 100))
    before.style.setProperty('--to', `${ui.compare.at * 100}%`)
  }
  const divideAt = (at) => store.set({ compare: { ...ui.compare, at: clamp(at, 0, 1) } })
  divider.addEventListener('pointerdown', (event) => {
    divider.setPointerCapture(event.pointerId)
    divider.focus()
    event.preventDefault()
  })
  divider.addEventListener('pointermove', (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return
    const { box } = layout()
    divideAt((pointOf(event)[0] - box[0]) / box[2])
  })
  divider.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key]
    if (!step) return
    event.preventDefault()
    divideAt(ui.compare.at + step)
  })

  new ResizeObserver(() => show('resize')).observe(stage)
  return {
    show,
    geometry,
    region: () => layout().region,
    zoomAt: (factor) => zoomAt(middle(), factor),
    panBy: (right, down) => ui.view.zoom > 1 && look(panned(...geometry(), [right, down])),
    whole: () => look(wholeView),
    pointOf,
  }
}
