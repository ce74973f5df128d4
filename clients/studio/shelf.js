// The shelf on the left: reliefs to open, looks to put on, surroundings to light with. Thumbnails are the server's own
// pictures, which the browser's cache keeps by their ETag; they are asked for one after the other, and only while the hand rests.
import { isPossible, lightingNames, underLighting } from './lightings.js'
import { environmentLight, overMap, same, shortened } from './scene.js'
import { make } from './widgets.js'

const side = 144 // pixels of a thumbnail

/** Loads pictures one at a time while `isIdle()`. @return ask(img, url) */
function thumbnailQueue(client, isIdle) {
  let waiting = []
  let running = false
  let later = null
  async function next() {
    clearTimeout(later)
    if (running || !waiting.length) return
    if (!isIdle()) return void (later = setTimeout(next, 120))
    running = true
    const { img, url } = waiting.shift()
    if (img.isConnected) img.className = (await shown(img, url, client)) ? 'there' : ''
    running = false
    next()
  }
  return (img, url) => {
    if (img.className) img.className = 'stale'
    waiting = [...waiting.filter((job) => job.img !== img), { img, url }]
    next()
  }
}

async function shown(img, url, client) {
  const src = await client.source(url).catch(() => '')
  const loaded = Object.assign(new Image(), { src })
  const whole = await loaded.decode().then(
    () => true,
    () => false,
  )
  if (whole) img.src = src
  else img.removeAttribute('src')
  await img.decode().catch(() => {})
  URL.revokeObjectURL(src) // of a blob; any other address has nothing to give back
  return whole
}

function card(title, { pressed = false, tip = null } = {}) {
  const img = make('img', { alt: '', width: side, height: side, draggable: false })
  const button = make(
    'button',
    { type: 'button', className: 'card', 'aria-pressed': String(pressed), 'data-tip': tip },
    make('span', { className: 'thumb' }, img),
    make('span', { className: 'title' }, title),
  )
  return { button, img }
}

const small = { width: side, format: 'webp', quality: 80 }
const capitals = (words) => words.replace(/(^|-)(.)/g, (_, dash, letter) => (dash ? ' ' : '') + letter.toUpperCase())
const brief = ({ name, title }) => (name ? capitals(name) : title)

/** @param actions  {openRelief(relief), choosePreset(name), chooseEnvironment(id)} */
export function bindShelf(store, client, catalogue, isIdle, actions) {
  const ask = thumbnailQueue(client, isIdle)
  const parts = { reliefs: '', looks: '', lighting: '', surroundings: '' }
  const fill = (id, key, cards) => {
    if (parts[id] === key) return false
    parts[id] = key
    document.querySelector(`#${id} .cards`).replaceChildren(...cards().map(({ button }) => button))
    return true
  }

  function showReliefs() {
    fill('reliefs', catalogue.reliefs.map(({ id }) => id).join(), () =>
      catalogue.reliefs.map((relief) => {
        const made = card(brief(relief), {
          tip: [relief.title, relief.credit, relief.licence].filter(Boolean).join('\n'),
        })
        made.button.dataset.id = relief.id
        made.button.addEventListener('click', () => actions.openRelief(relief))
        ask(made.img, client.url({ ...relief.scene, height: { image: relief.id }, output: small }))
        return made
      }),
    )
    for (const button of document.querySelectorAll('#reliefs .card'))
      button.setAttribute('aria-pressed', String(button.dataset.id === store.scene.height.image))
  }

  function showLooks() {
    const { height, alpha, albedo } = store.scene
    const images = { height, ...(alpha && { alpha }), ...(albedo && { albedo }) }
    fill('looks', 'made', () =>
      catalogue.presets.map(({ name, description }) => {
        const made = card(capitals(name), { tip: description })
        made.button.dataset.name = name
        made.button.addEventListener('click', () => actions.choosePreset(name))
        return made
      }),
    )
    if (parts.of !== JSON.stringify(images)) {
      parts.of = JSON.stringify(images)
      for (const button of document.querySelectorAll('#looks .card'))
        ask(button.querySelector('img'), client.url({ preset: button.dataset.name, ...images, output: small }))
    }
    for (const button of document.querySelectorAll('#looks .card'))
      button.setAttribute('aria-pressed', String(isLook(button.dataset.name)))
  }

  /** Whether the scene still is what the preset made of it. */
  const isLook = (name) => store.look?.name === name && same(store.look.scene, store.scene)

  // Under the look that is on, so they are made anew when it has changed and rests.
  let late = null
  function showLighting() {
    const sky = actions.environments()[0]?.id
    fill('lighting', 'made', () =>
      lightingNames(sky).map((name) => {
        const made = card(name)
        made.button.dataset.name = name
        made.button.addEventListener('click', () => store.open(underLighting(store.scene, name, sky)))
        return made
      }),
    )
    const buttons = [...document.querySelectorAll('#lighting .card')]
    for (const button of buttons) {
      const scene = underLighting(store.scene, button.dataset.name, sky)
      button.disabled = !isPossible(scene)
      button.setAttribute('aria-pressed', String(same(scene.lights, store.scene.lights)))
    }
    const { lights, ...look } = store.scene
    if (same(look, parts.under)) return
    parts.under = look
    clearTimeout(late)
    late = setTimeout(() => {
      const { exposure, tone, transfer, background } = store.scene.output
      const output = { ...catalogue.defaults.scene.output, exposure, tone, transfer, background, ...small }
      for (const button of buttons.filter(({ disabled }) => !disabled)) {
        const scene = underLighting({ ...store.scene, output }, button.dataset.name, sky)
        ask(button.querySelector('img'), client.url(shortened(scene, catalogue.defaults)))
      }
    }, 600)
  }

  function showSurroundings() {
    const light = store.scene.lights[store.ui.active]
    if (light.type !== 'environment') return
    const all = actions.environments()
    const { height } = store.scene
    fill('surroundings', all.map(({ id }) => id).join() + height.image, () =>
      all.map((environment) => {
        const made = card(brief(environment), { tip: environment.title })
        made.button.dataset.id = environment.id
        made.button.addEventListener('click', () => actions.chooseEnvironment(environment.id))
        ask(
          made.img,
          client.url({ height, light: { type: 'environment', image: { image: environment.id } }, output: small }),
        )
        return made
      }),
    )
    for (const button of document.querySelectorAll('#surroundings .card'))
      button.setAttribute('aria-pressed', String(button.dataset.id === light.image.image))
  }

  return () => {
    if (!store.scene) return
    showReliefs()
    showLooks()
    showLighting()
    showSurroundings()
  }
}

/** What a file that was opened becomes: the scene with it in its place. @param role  height, alpha, albedo or environment */
export function sceneWith(scene, role, id, active) {
  if (role === 'height') return overMap(scene, id)
  if (role !== 'environment') return { ...scene, [role]: { image: id } }
  const before = scene.lights[active]
  const light = before.type === 'environment' ? { ...before, image: { image: id } } : environmentLight(id)
  return { ...scene, lights: scene.lights.map((other, i) => (i === active ? light : other)) }
}

/** What a file is most likely for: panoramas in the formats of high dynamic range light, all else is a height map. */
export const likelyRole = (file) => (/\.hdr$/i.test(file.name ?? '') ? 'environment' : 'height')
