// Pages of another origin with one <relit-image>, and what their tests look at.
import assert from 'node:assert/strict'
import { after } from 'node:test'
import { countFetches, openPage, staged } from '../studio/support.js'
import { startSite } from './site.js'

// Runs in the page: what the element tells, as plain numbers, and what is fetched at once. `shown` is in displayed frames.
const watching = `
  const seen = { lights: [], frames: [], errors: [], recoveries: 0 }
  ;(${countFetches})('')
  const x = ({ lights }) => lights[0].position?.[0]
  addEventListener('relit-light', ({ detail: { rest, scene } }) => seen.lights.push({ rest, x: x(scene) }))
  addEventListener('relit-frame', ({ detail: { scene, final, width, height, etag, accuracy } }) =>
    seen.frames.push({ x: x(scene), relief: scene.relief, final, width, height, etag, accuracy }))
  addEventListener('relit-error', ({ detail: { error: { status, code, message }, again } }) =>
    seen.errors.push({ status, code, message, again }))
  addEventListener('relit-recovery', () => ++seen.recoveries)`

/** As staged(), with a site of another origin: {server, browser, site, pages}. */
export async function stagedSite(options) {
  const stage = await staged(options)
  const pages = {}
  const site = await startSite(pages)
  after(site.close)
  return { ...stage, site, pages }
}

/**
 * A page at the site's / with `tag`, the module from the stage's server, and what the element tells in `seen`. page.done()
 * closes it, and fails where something was on the console or a script failed, unless page.expectTroubles.
 * @param options  of the browser's context; server: another address; policy: whether the page has a strict one
 */
export async function openSite(stage, tag, { policy, server = stage.server.address, ...options } = {}) {
  const { browser, site, pages } = stage
  pages['/watching.js'] = ['text/javascript', watching]
  pages['/page.css'] = ['text/css', 'body{margin:20px}relit-image{max-width:512px}']
  const rules = `default-src 'self'; script-src 'self' ${server}; connect-src ${server}; img-src data:`
  pages['/'] = `<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
    ${policy ? `<meta http-equiv="Content-Security-Policy" content="${rules}">` : ''}
    <title>A page</title><link rel=icon href=data:,><link rel=stylesheet href=page.css><script src=watching.js></script>
    <script type=module src="${server}/relit.js"></script>${tag}`
  const page = await openPage(browser, site.address, options)
  page.done = async () => {
    const troubles = page.troubles.filter((trouble) => !trouble.startsWith('request to ' + server))
    await page.context().close()
    if (!page.expectTroubles) assert.deepEqual(troubles, [])
  }
  await rested(page)
  return page
}

/** The element has its final picture, or an error that will not pass. */
export const rested = (page) => page.waitForSelector('relit-image[aria-busy="false"]')
export const boxOf = (page) => page.locator('relit-image').boundingBox()
export const light = (page) => page.locator('relit-image').evaluate(({ scene, active }) => scene.lights[active])

/** How bright the picture's left half is, as a share of the whole, and its upper half. */
export const brightness = (page) => page.locator('relit-image').evaluate((image) => {
  const copy = Object.assign(document.createElement('canvas'), { width: 64, height: 64 })
  const context = copy.getContext('2d')
  context.drawImage(image.shadowRoot.querySelector('canvas'), 0, 0, 64, 64)
  const { data } = context.getImageData(0, 0, 64, 64)
  let [all, left, top] = [0, 0, 0]
  for (let y = 0; y < 64; ++y)
    for (let x = 0; x < 64; ++x) {
      const at = 4 * (64 * y + x)
      const brightness = (data[at] + data[at + 1] + data[at + 2]) * data[at + 3]
      all += brightness
      left += brightness * (x < 32)
      top += brightness * (y < 32)
    }
  return { left: left / all, top: top / all }
})
