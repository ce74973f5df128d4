// Thumbnails: the server's own pictures, small. They are asked for one after the other, and only while the hand rests. The
// browser's cache keeps them by their ETag, but for those of light below the surface: these are previews, which take the
// server little and are made anew.
import { isTranslucent } from './models.js'
import { make } from './widgets.js'

const side = 144 // pixels of a thumbnail

/** Loads pictures one at a time while `isIdle()`. @return ask(img, url) */
export function thumbnailQueue(client, isIdle) {
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
  img.src = src
  const isWhole = await img.decode().then(
    () => true,
    () => false,
  )
  if (!isWhole) img.removeAttribute('src')
  URL.revokeObjectURL(src) // of a blob; any other address has nothing to give back
  return isWhole
}

export function card(title, { pressed = false, tip = null } = {}) {
  const img = make('img', { alt: '', width: side, height: side, draggable: false })
  const button = make(
    'button',
    { type: 'button', className: 'card', 'aria-pressed': String(pressed), 'data-tip': tip },
    make('span', { className: 'thumb' }, img),
    make('span', { className: 'title' }, title),
  )
  return { button, img }
}

/** Of the output of a thumbnail. */
export const small = { width: side, format: 'webp', quality: 80 }

export const accuracyOf = (scene) => (isTranslucent(scene) ? 'preview' : 'final')

/** Of the scene as a thumbnail shows it: its picture, whichever layer is looked at. */
export function thumbnailOutput(scene, defaults) {
  const { exposure, tone, transfer, background } = scene.output
  return { ...defaults.scene.output, exposure, tone, transfer, background, ...small, accuracy: accuracyOf(scene) }
}
