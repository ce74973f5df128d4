// The shelf on the left: reliefs to open, looks to put on, surroundings to light with, each as a thumbnail.
import { isPossible, lightingNames, underLighting } from './lightings.js'
import { isTranslucent, workable } from './models.js'
import { environmentLight, overMap, same, shortened } from './scene.js'
import { accuracyOf, card, small, thumbnailOutput } from './thumbnails.js'

const capitals = (words) => words.replace(/(^|-)(.)/g, (_, dash, letter) => (dash ? ' ' : '') + letter.toUpperCase())
const brief = ({ name, title }) => (name ? capitals(name) : title)

/** What a look is called on the shelf; those of one group need not say which it is. */
const lookTitle = ({ name }) => capitals(name.replace(/^translucent-/, ''))

/**
 * @param ask      of thumbnails.js
 * @param actions  {openRelief(relief), choosePreset(name), chooseEnvironment(id)}
 */
export function bindShelf(store, client, catalogue, ask, actions) {
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
    const { height, alpha, albedo, bump } = store.scene
    const images = { height, ...(alpha && { alpha }), ...(albedo && { albedo }), ...(bump && { bump }) }
    const isBelow = ({ scene }) => isTranslucent(scene)
    const cards = (presets) => () =>
      presets.map((preset) => {
        const made = card(lookTitle(preset), { tip: preset.description })
        made.button.dataset.name = preset.name
        made.button.addEventListener('click', () => actions.choosePreset(preset.name))
        return made
      })
    fill('looks', 'made', cards(catalogue.presets.filter((preset) => !isBelow(preset))))
    fill('looks-below', 'made', cards(catalogue.presets.filter(isBelow)))
    if (parts.of !== JSON.stringify(images)) {
      parts.of = JSON.stringify(images)
      for (const { name, scene } of [...catalogue.presets].sort((a, b) => isBelow(a) - isBelow(b))) {
        const output = { ...small, accuracy: accuracyOf(scene) }
        ask(document.querySelector(`#looks [data-name="${name}"] img`), client.url({ preset: name, ...images, output }))
      }
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
        made.button.addEventListener('click', () => store.open(workable(underLighting(store.scene, name, sky))))
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
      const output = thumbnailOutput(store.scene, catalogue.defaults)
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

/** What a file that was opened becomes: the scene with it in its place. @param role  height, alpha, albedo, bump or environment */
export function sceneWith(scene, role, id, active) {
  if (role === 'height') return overMap(scene, id)
  if (role !== 'environment') return { ...scene, [role]: { image: id } }
  const before = scene.lights[active]
  const light = before.type === 'environment' ? { ...before, image: { image: id } } : environmentLight(id)
  return { ...scene, lights: scene.lights.map((other, i) => (i === active ? light : other)) }
}

/** What a file is most likely for: panoramas in the formats of high dynamic range light, all else is a height map. */
export const likelyRole = (file) => (/\.hdr$/i.test(file.name ?? '') ? 'environment' : 'height')
