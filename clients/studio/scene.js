// Scenes of the interface as the studio holds them: whole, with `lights`. Plain functions, no page.

/** A scene as the server completes it -> as the studio holds it. */
export const heldScene = ({ light, ...scene }) => (light ? { ...scene, lights: [light] } : scene)

/** The scene of a word in an address (base64url of its JSON, as GET /v1/render takes it), or nothing where it is none. */
export function decodeScene(word) {
  try {
    const base64 = atob(word.replaceAll('-', '+').replaceAll('_', '/'))
    const scene = JSON.parse(new TextDecoder().decode(Uint8Array.from(base64, (byte) => byte.charCodeAt(0))))
    return scene?.height?.image ? scene : null
  } catch {
    return null
  }
}

/** A colour of the interface as #rrggbb; linear ones are sRGB-encoded, too bright ones dimmed to fit. */
export function hexColour(colour) {
  if (typeof colour === 'string') return colour.toLowerCase()
  const brightest = Math.max(1, ...colour)
  const digits = colour.map((linear) => {
    const share = linear / brightest
    const encoded = share <= 0.0031308 ? 12.92 * share : 1.055 * share ** (1 / 2.4) - 0.055
    return Math.round(encoded * 255)
      .toString(16)
      .padStart(2, '0')
  })
  return '#' + digits.join('')
}

/** The member at a dotted path, as in 'material.specular.k'. */
export const member = (scene, path) => path.split('.').reduce((value, name) => value?.[name], scene)

/** The scene with the member at a dotted path replaced. */
export function withMember(scene, path, value) {
  const [name, ...rest] = path.split('.')
  const copy = Array.isArray(scene) ? [...scene] : { ...scene }
  copy[name] = rest.length ? withMember(scene[name], rest.join('.'), value) : value
  return copy
}

export const same = (a, b) => JSON.stringify(a) === JSON.stringify(b)

const isObject = (value) => value !== null && typeof value === 'object' && !Array.isArray(value)

/** What of an object differs from its defaults. */
function differences(value, defaults) {
  const kept = Object.entries(value).flatMap(([name, part]) => {
    if (!isObject(part) || !isObject(defaults[name])) return same(part, defaults[name]) ? [] : [[name, part]]
    const below = differences(part, defaults[name])
    return Object.keys(below).length ? [[name, below]] : []
  })
  return Object.fromEntries(kept)
}

/**
 * The shortest scene that is completed to the same, for people to read and addresses to hold.
 * @param defaults  {scene: a scene with nothing but defaults, whole, point, directional, environment: fields of lights}
 */
export function shortened({ lights, height, ...scene }, defaults) {
  const short = { height, ...differences(scene, defaults.scene) }
  const kept = lights.map((light) => ({
    type: light.type,
    ...differences(light, { ...defaults[light.type], type: light.type }),
  }))
  if (kept.length > 1) return { ...short, lights: kept }
  return same(kept[0], { type: 'point' }) ? short : { ...short, light: kept[0] }
}

/** Every image that the scene names. */
export const imagesOf = ({ height, alpha, albedo, bump, lights }) =>
  [height, alpha, albedo, bump, ...lights.map(({ image }) => image)].flatMap((source) => source?.image ?? [])

/**
 * The scene as the picture on the page shows it.
 * @param solo    index of the one light that shines, or null
 * @param region  of the map, in texels; null: all of it
 */
export const shownScene = (scene, { solo, region }) => ({
  ...scene,
  lights: solo == null ? scene.lights : [scene.lights[solo]],
  output: { ...scene.output, region },
})

/** Another height map under the same look: what depended on the map before goes back to its default. */
export const overMap = (scene, id) => ({
  ...scene,
  height: { image: id },
  alpha: null,
  albedo: null,
  bump: null,
  output: { ...scene.output, width: null, height: null, region: null },
})

/** Whether a light shines from behind the picture. */
export const isBehind = ({ position, direction, elevation }) => (position?.[2] ?? direction?.[2] ?? elevation ?? 0) < 0

/** Surroundings as the light. @param id  of an image */
export const environmentLight = (id) => ({
  type: 'environment',
  image: { image: id },
  rotation: [0, 0],
  intensity: 'auto',
  weighting: 'solid-angle',
  radius: null,
})

const newcomers = {
  point: { type: 'point', position: [0.85, 0.85, 0.6], color: '#ffffff', intensity: 1 },
  directional: { type: 'directional', azimuth: 315, elevation: 35, color: '#ffffff', intensity: 1 },
}

/** A light of a kind; of the one before what both kinds have. An environment takes the id of an image. */
export function newLight(type, image, before) {
  const light = newcomers[type] ?? environmentLight(image)
  if (!light.color || !before?.color) return light
  return { ...light, color: before.color, intensity: before.intensity }
}
