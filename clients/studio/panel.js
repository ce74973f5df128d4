// The panel on the right: rows of controls.js for the scene, and for the light in hand above them.
import { lightControls, sceneControls } from './controls.js'
import { lightAt, handlePosition, spokenLight } from '../relit.js'
import { mediumWidget, sizeWidget } from './medium.js'
import { workable } from './models.js'
import { hexColour, member, newLight, withMember } from './scene.js'
import { make, segments, widgetOf } from './widgets.js'

const kindNames = { point: 'Point', directional: 'Sun', environment: 'Surroundings' }

const ofMedia = { medium: mediumWidget, size: sizeWidget }

/** Rows into their groups. @param media  as medium.js takes it @return show(), to be called when the scene has changed */
export function bindPanel(store, fields, media) {
  const rows = []
  for (const [group, controls] of Object.entries(sceneControls)) {
    const body = document.querySelector(`#${group} .rows`)
    for (const control of controls) {
      const put = control.put ?? ((scene, value) => withMember(scene, control.path, value))
      const tell = (value, gesture) => {
        if (value == null && gesture != null) return store.settle()
        store.change(workable(put(store.scene, value)), gesture)
      }
      const widget = (ofMedia[control.kind] ?? widgetOf)(control, fields.get(control.path), tell, media)
      const head = control.head && make('h3', {}, control.head)
      body.append(...[head, widget.root].filter(Boolean))
      rows.push({ control, widget, head })
    }
  }
  const showLights = bindLights(store, fields)
  return () => {
    if (!store.scene) return
    showLights()
    for (const { control, widget, head } of rows) {
      const isShown = control.shown?.(store.scene) ?? true
      widget.root.hidden = !isShown
      if (head) head.hidden = !isShown
      if (isShown) showRow(widget, member(store.scene, control.path), control.when?.(store.scene) ?? true, store.scene)
    }
  }
}

function showRow(widget, value, enabled, scene) {
  widget.root.classList.toggle('off', !enabled)
  widget.show(value, enabled, scene)
}

function bindLights(store, fields) {
  const light = () => store.scene.lights[store.ui.active]
  const put = (next, gesture = null) =>
    store.change(workable(withMember(store.scene, `lights.${store.ui.active}`, next)), gesture)
  const kind = segments('Kind of light', Object.entries(kindNames), (type) =>
    put(newLight(type, environmentsOf(store)[0]?.id, light())),
  )
  document.getElementById('kind').append(kind.root)
  const pad = bindPad(light, put, store)
  const bodies = Object.fromEntries(
    Object.entries(lightControls).map(([type, controls]) => {
      const rows = controls.map((control) => {
        const widget = widgetOf(
          control,
          fields.get(`${type}.${control.path.replace(/\.\d$/, '')}`),
          (value, gesture) => {
            if (value == null && gesture != null) return store.settle()
            const base =
              control.path.startsWith('azimuth') || control.path.startsWith('elevation') ? withAngles(light()) : light()
            put(withMember(base, control.path, value), gesture)
          },
        )
        return { control, widget }
      })
      const body = make(
        'div',
        {},
        rows.map(({ widget }) => widget.root),
      )
      document.getElementById('light-rows').append(body)
      return [type, { body, rows }]
    }),
  )
  document.getElementById('add-light').addEventListener('click', () => {
    const lights = [...store.scene.lights, newLight('point')]
    store.change({ ...store.scene, lights })
    store.set({ active: lights.length - 1, solo: null })
  })
  const most = fields.get('lights')?.most ?? Infinity
  return () => {
    showList(store)
    const now = light()
    kind.show(now.type)
    pad.show()
    document.getElementById('surroundings').hidden = now.type !== 'environment'
    document.getElementById('add-light').disabled = store.scene.lights.length >= most
    for (const [type, { body, rows }] of Object.entries(bodies)) {
      body.hidden = type !== now.type
      if (type === now.type)
        for (const { control, widget } of rows) showRow(widget, member(withAngles(now), control.path), true)
    }
  }
}

/** The environments that can be chosen: samples, what was opened, and what the scene has. */
export function environmentsOf(store) {
  const known = store.environments ?? []
  const used = (store.scene?.lights ?? []).flatMap(({ image }) => image?.image ?? [])
  return [
    ...known,
    ...used.filter((id) => !known.some((other) => other.id === id)).map((id) => ({ id, title: 'Of this scene' })),
  ]
}

/** A sun by its angles, whichever way it was said. */
function withAngles(light) {
  if (!light.direction) return light
  const {
    direction: [x, y, z],
    ...rest
  } = light
  const degrees = 180 / Math.PI
  const azimuth = Number(((Math.atan2(x, y) * degrees + 360) % 360).toFixed(2))
  return { ...rest, azimuth, elevation: Number((Math.atan2(z, Math.hypot(x, y)) * degrees).toFixed(2)) }
}

const listed = (scene, ui) =>
  JSON.stringify([scene.lights.map((light) => [light.type, light.color]), ui.active, ui.solo])
let shownList = ''

// The list is made anew only where it differs, so that a focused button stays where it is while a light moves.
function showList(store) {
  const list = document.getElementById('lights')
  const { scene, ui } = store
  if (listed(scene, ui) !== shownList) {
    shownList = listed(scene, ui)
    const focused = document.activeElement?.dataset?.act
    list.replaceChildren(...scene.lights.map((light, i) => lightItem(store, light, i)))
    if (focused) list.querySelector(`[data-act="${focused}"]`)?.focus()
  }
  scene.lights.forEach((light, i) => (list.children[i].querySelector('small').textContent = briefly(withAngles(light))))
}

function lightItem(store, light, i) {
  const { ui, scene } = store
  const name = `${kindNames[light.type]}${scene.lights.length > 1 ? ` ${i + 1}` : ''}`
  const choose = make(
    'button',
    { type: 'button', className: 'choose', 'aria-pressed': String(i === ui.active), 'data-act': `choose-${i}` },
    make('span', { className: 'swatch' }),
    make('span', {}, name),
    make('small'),
  )
  choose
    .querySelector('.swatch')
    .style.setProperty(
      '--colour',
      light.color ? hexColour(light.color) : 'conic-gradient(#d66,#dd6,#6b6,#6bd,#66d,#d6b,#d66)',
    )
  choose.addEventListener('click', () => store.set({ active: i, solo: ui.solo == null ? null : i }))
  const solo = make(
    'button',
    {
      type: 'button',
      className: 'mini',
      'aria-pressed': String(i === ui.solo),
      'aria-label': `${name} alone`,
      'data-act': `solo-${i}`,
      'data-tip': 'Alone: the other lights are off while you look; the scene keeps them.',
    },
    'S',
  )
  solo.addEventListener('click', () => store.set({ solo: ui.solo === i ? null : i, active: i }))
  const remove = make(
    'button',
    { type: 'button', className: 'mini', 'aria-label': `Remove ${name}`, 'data-act': `remove-${i}` },
    '×',
  )
  remove.addEventListener('click', () => {
    store.change({ ...store.scene, lights: store.scene.lights.filter((_, k) => k !== i) })
    document.getElementById('add-light').focus()
  })
  const several = scene.lights.length > 1
  return make('li', { className: i === ui.active ? 'active' : '' }, choose, several ? [solo, remove] : [])
}

function briefly(light) {
  const round = (number) => String(Math.round(number * 100) / 100)
  if (light.type === 'point') return light.position.map(round).join(', ')
  if (light.type === 'directional') return `${Math.round(light.azimuth)}°, ${Math.round(light.elevation)}°`
  return `${Math.round(light.rotation[0])}°, ${Math.round(light.rotation[1])}°`
}

const around = [-0.5, -0.5, 2, 2] // of the map, on the pad of a point light

// The pad: a dome for a sun, the map and its surroundings for a point, yaw and pitch for an environment.
function bindPad(light, put, store) {
  const pad = document.getElementById('pad')
  const dot = document.getElementById('pad-dot')
  const crop = () => (light().type === 'point' ? around : undefined)
  const size = [1, 1] // shares of the pad
  // A sun's horizon is inside the pad, so that what is outside of it can come from behind.
  const inner = () => (light().type === 'directional' ? 0.62 : 1)
  const scaled = (at, by) => at.map((share) => 0.5 + (share - 0.5) * by)
  const clamped = (at) => at.map((share) => Math.min(Math.max(share, 0), 1))
  const move = (event) => {
    const box = pad.getBoundingClientRect()
    const at = clamped([(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height])
    put(lightAt(light(), scaled(at, 1 / inner()), size, crop()), 'pad')
  }
  pad.addEventListener('pointerdown', (event) => {
    if (event.button) return
    pad.setPointerCapture(event.pointerId)
    dot.focus()
    event.preventDefault()
    move(event)
  })
  pad.addEventListener('pointermove', (event) => pad.hasPointerCapture(event.pointerId) && move(event))
  pad.addEventListener('lostpointercapture', () => store.settle())
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }
  dot.addEventListener('keydown', (event) => {
    if (!arrows[event.key]) return
    event.preventDefault()
    const step = event.shiftKey ? 0.05 : 0.01
    const [x, y] = handlePosition(light(), size, crop())
    put(lightAt(light(), [x + arrows[event.key][0] * step, y + arrows[event.key][1] * step], size, crop()), 'pad-key')
  })
  dot.addEventListener('keyup', () => store.settle())
  return {
    show() {
      const now = light()
      pad.dataset.kind = now.type
      const [x, y] = clamped(scaled(handlePosition(now, size, crop()), inner()))
      dot.style.left = `${x * 100}%`
      dot.style.top = `${y * 100}%`
      dot.setAttribute('aria-valuenow', Math.round(x * 100))
      dot.setAttribute('aria-valuetext', spokenLight(now))
    },
  }
}
