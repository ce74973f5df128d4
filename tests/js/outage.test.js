// <relit-image> while its server is away, and when it is back. Names are claims.
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { boxOf, openSite, rested, stagedSite } from './pages.js'
import { plato } from './site.js'

const stage = await stagedSite()
const { server, browser, site, pages } = stage

test('while the server is away it is asked now and then, and its first picture is of where the light is by then', async () => {
  const tag = `<relit-image src="${plato}" light="0.5,0.5,0.5"></relit-image>`
  const page = await openSite(stage, tag)
  page.expectTroubles = true // refused connections are put on the console by the browser itself
  const box = await boxOf(page)
  const click = (x) => page.mouse.click(box.x + x * box.width, box.y + 0.5 * box.height)
  await server.stop()
  await click(0.25)
  await page.waitForFunction(() => seen.errors.length >= 3)
  await click(0.75) // goes on being dragged while there is no picture
  const { errors, recoveries, lights } = await page.evaluate(() => seen)
  assert.ok(errors.every(({ status, message }) => status === 0 && message === 'The server does not answer.'))
  assert.deepEqual(errors.slice(0, 3).map(({ again }) => again), [250, 500, 1000])
  assert.equal(recoveries, 0)
  assert.equal(await page.getAttribute('relit-image', 'aria-busy'), 'true')
  assert.ok(Math.abs(lights.at(-1).x - 0.75) < 0.01)

  await server.start()
  await page.waitForFunction(() => seen.recoveries === 1)
  await rested(page)
  const { frames, errors: all } = await page.evaluate(() => seen)
  assert.ok(Math.abs(frames.at(-1).x - 0.75) < 0.01 && frames.at(-1).final)
  assert.ok(frames.slice(1).every(({ x }) => x > 0.7), 'no picture of the light of before')
  assert.ok(all.length <= 6, `${all.length} requests while it was away`)
  await page.done()
})

test('a page that is opened before its server shows its picture when it comes', async () => {
  const { address } = server
  const module = await (await fetch(address + '/relit.js')).text()
  await server.stop()
  pages['/relit.js'] = ['text/javascript', module]
  pages['/early'] = `<!doctype html><script type=module src=relit.js></script>
    <relit-image server="${address}" src="${plato}" preset=wax></relit-image>`
  const context = await browser.newContext()
  const page = await context.newPage()
  const failed = page.waitForEvent('requestfailed')
  await page.goto(site.address + '/early')
  await failed
  await server.start()
  await rested(page)
  assert.equal(await page.locator('relit-image').evaluate(({ map }) => map.width), 512)
  await context.close()
})
