// The examples, and the snippets of the README, each opened as it is, but for the server's address. Names are claims.
import assert from 'node:assert/strict'
import { readFile } from 'node:fs/promises'
import { test } from 'node:test'
import { keep, openPage } from '../studio/support.js'
import { stagedSite } from './pages.js'

const written = 'http://127.0.0.1:8080'
const clients = new URL('../../clients/', import.meta.url)

const { server, browser, site, pages } = await stagedSite()

async function open(html) {
  assert.ok(html.includes(written))
  pages['/'] = '<link rel=icon href=data:,>' + html.replaceAll(written, server.address)
  const page = await openPage(browser, 'about:blank', { viewport: { width: 1000, height: 640 } })
  await page.route('https://esm.sh/**', (route) => react(new URL(route.request().url()).pathname).then((body) => route.fulfill({
    body, contentType: 'text/javascript', headers: { 'Access-Control-Allow-Origin': '*' },
  })))
  await page.goto(site.address)
  page.done = async () => {
    const troubles = page.troubles.filter((trouble) => !trouble.startsWith('request to '))
    await page.context().close()
    assert.deepEqual(troubles, [])
  }
  return page
}
const rested = (page, count) => page.waitForFunction((count) => {
  const images = [...document.querySelectorAll('relit-image')]
  return images.length === count && images.every((image) => image.ariaBusy === 'false' && image.map)
}, count)
const example = (name) => readFile(new URL('examples/' + name, clients), 'utf8')

// What the address of a package of React's gives, made of what npm has installed: CommonJS as an ES module.
async function react(path) {
  const file = (name) => readFile(new URL(`node_modules/${name}`, import.meta.url), 'utf8')
  const wrapped = (source, names) => `
    const module = { exports: {} }
    const require = (name) => ({ ${names.map((name, i) => `'${name}': need${i}`).join(', ')} })[name]
    ${names.map((name, i) => `import need${i} from 'https://esm.sh/${name}@19.2.0'`).join('\n')}
    ;(function (exports) { ${source} })(module.exports)
    export default module.exports
    export const { createElement, useState, createRoot } = module.exports`
  const needs = { 'react': [], 'scheduler': [], 'react-dom': ['react'], 'react-dom-client': ['scheduler', 'react', 'react-dom'] }
  const name = path.slice(1).replace(/@[\d.]+/, '').replace('/', '-')
  return wrapped(await file(`${name.replace('-client', '')}/cjs/${name}.production.js`), needs[name])
}

test('the plain example shows three reliefs whose lights are dragged, in less than 40 lines', async () => {
  const html = await example('three.html')
  assert.ok(html.split('\n').length <= 40)
  const page = await open(html)
  await rested(page, 3)
  const types = await page.$$eval('relit-image', (images) => images.map(({ scene }) => scene.lights[0].type))
  assert.deepEqual(types, ['point', 'directional', 'environment'])
  for (const image of await page.locator('relit-image').all()) {
    const before = await image.getByRole('slider').getAttribute('aria-valuetext')
    const box = await image.boundingBox()
    await page.mouse.move(box.x + 90, box.y + 90)
    await page.mouse.down()
    await page.mouse.move(box.x + 70, box.y + 120, { steps: 3 })
    await page.mouse.up()
    assert.notEqual(await image.getByRole('slider').getAttribute('aria-valuetext'), before)
  }
  await rested(page, 3)
  await keep(page, 'three')
  await page.done()
})

test('the example in React shows a relief, hears of its light and changes its material, in less than 40 lines', async () => {
  const html = await example('react.html')
  assert.ok(html.split('\n').length <= 40)
  const page = await open(html)
  await rested(page, 1)
  const box = await page.locator('relit-image').boundingBox()
  await page.mouse.click(box.x + box.width / 4, box.y + box.height / 4)
  await page.getByText('The light is at 0.25').waitFor()
  await page.selectOption('select', 'wax')
  await page.waitForFunction(() => document.querySelector('relit-image').scene.lights.length === 2)
  await rested(page, 1)
  await page.done()
})

test('the snippets of the README do what they say', async () => {
  const snippets = [...(await readFile(new URL('js/README.md', clients), 'utf8')).matchAll(/^```html\n([^]*?)^```$/gm)]
  assert.equal(snippets.length, 3)
  const [element, events, client] = snippets.map(([, html]) => html)

  const one = await open(element)
  await rested(one, 1)
  assert.equal(await one.locator('relit-image').evaluate(({ scene }) => scene.relief), 0.12) // bronze
  await one.done()

  const two = await open(events)
  await rested(two, 1)
  await two.getByText('pixels wide in').waitFor()
  await two.getByLabel('Height').fill('0.4')
  assert.equal(await two.locator('relit-image').evaluate(({ scene }) => scene.relief), 0.4)
  await rested(two, 1)
  await two.done()

  const three = await open(client)
  await three.getByText(/bytes in .* then 12 frames/).waitFor()
  await three.done()
})
