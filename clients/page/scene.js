// Scenes of the interface as the page holds them: whole, with `lights`. Plain functions, no page.

/** A scene as the server completes it -> as the page holds it: of its output only what belongs to the look. */
export function heldScene({ output, light, ...scene }) {
  const { exposure, tone, transfer } = output
  return { ...scene, ...(light && { lights: [light] }), output: { exposure, tone, transfer } }
}

/** What to ask for while the hand moves: coarse, and on the colour behind the picture. */
export const previewOf = (scene, width, background) => ({
  ...scene,
  output: { ...scene.output, accuracy: 'preview', format: 'jpeg', quality: 80, width, background },
})

/** What to ask for when it rests. */
export const finalOf = (scene, width) => ({
  ...scene,
  output: { ...scene.output, format: 'webp', quality: 92, width },
})

/** A scene as one word for an address: base64url of its JSON, as GET /v1/render takes it. */
export function encodeScene(scene) {
  const bytes = new TextEncoder().encode(JSON.stringify(scene))
  const base64 = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''))
  return base64.replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '')
}

/** The scene of such a word, or nothing where it is none. */
export function decodeScene(word) {
  try {
    const base64 = atob(word.replaceAll('-', '+').replaceAll('_', '/'))
    return JSON.parse(new TextDecoder().decode(Uint8Array.from(base64, (byte) => byte.charCodeAt(0))))
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
    return Math.round(encoded * 255).toString(16).padStart(2, '0')
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
