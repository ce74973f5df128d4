// The pages in a real browser against a real server. Names are claims.
import assert from 'node:assert/strict'
import { readFile } from 'node:fs/promises'
import { join } from 'node:path'
import { after, before, test } from 'node:test'
import { fileURLToPath } from 'node:url'
import { boxOf, drag, halves, lightNow, message, openPage, rested, startBrowser, startServer } from './support.js'

let server
let browser
before(async () => {
  server = await startServer()
  browser = await startBrowser()
})
after(async () => {
  await browser?.close()
  await server?.remove()
})

const repository = fileURLToPath(new URL('../..', import.meta.url))
const open = async (path = '/', options) => {
  const page = await openPage(browser, server.address + path, options)
  if (path === '/' || path.startsWith('/#')) await rested(page)
  return page
}
const close = (page) => page.context().close()
const keep = async (page, name) => {
  if (process.env.SCREENSHOTS) await page.screenshot({ path: join(process.env.SCREENSHOTS, `${name}.png`) })
}
const withoutTrouble = (page) => assert.deepEqual(page.troubles, [])
const catalogue = async (path) => (await fetch(server.address + path)).json()

test('every file of the pages is typed, revalidated and under a strict policy', async () => {
  const types = { '/': 'text/html', '/docs': 'text/html', '/page/page.js': 'text/javascript', '/page/page.css': 'text/css',
    '/page/light.js': 'text/javascript', '/page/icon.svg': 'image/svg+xml' }
  for (const [path, type] of Object.entries(types)) {
    const reply = await fetch(server.address + path)
    assert.equal(reply.status, 200, path)
    assert.equal(reply.headers.get('Content-Type'), `${type}; charset=utf-8`, path)
    assert.equal(reply.headers.get('Cache-Control'), 'no-cache', path)
    assert.match(reply.headers.get('Content-Security-Policy'), /^default-src 'self'; img-src 'self' blob: data:;/, path)
    const etag = reply.headers.get('ETag')
    assert.match(etag, /^"[0-9a-f]{32}"$/, path)
    const known = await fetch(server.address + path, { headers: { 'If-None-Match': etag } })
    assert.equal(known.status, 304, path)
    const head = await fetch(server.address + path, { method: 'HEAD' })
    assert.equal(head.headers.get('ETag'), etag, path)
    assert.equal(head.headers.get('Content-Length'), String((await reply.arrayBuffer()).byteLength), path)
  }
  assert.equal((await fetch(server.address + '/page/package.json')).status, 404)
})

test('the page shows a lit relief, from its own server only', async () => {
  const page = await open()
  const [left, right] = await halves(page)
  assert.ok(left > 10 && right > 10, 'there is a picture')
  assert.equal(await message(page), '')
  assert.match(await page.textContent('#timing'), /^final \d+ ms$/)
  withoutTrouble(page)
  await keep(page, 'first')
  await close(page)
})

test('the brightest side follows the light, and the final picture comes when the hand rests', async () => {
  const page = await open()
  const frames = []
  page.on('request', (request) => request.url().endsWith('/v1/render') && frames.push(request.postDataJSON().output))
  await drag(page, [0.5, 0.4], [-0.045, 0.4])
  await rested(page)
  const fromLeft = await halves(page)
  assert.ok(frames.some(({ accuracy }) => accuracy === 'preview'), 'previews while dragging')
  assert.equal(frames.at(-1).accuracy, undefined)
  assert.equal(await page.locator('#light.outside').count(), 1, 'the handle stays in sight')
  await drag(page, [0.5, 0.4], [0.99, 0.4])
  await rested(page)
  const fromRight = await halves(page)
  assert.ok(fromLeft[0] > fromRight[0] + 3, `left half: ${fromLeft[0]} then ${fromRight[0]}`)
  assert.ok(fromRight[1] > fromLeft[1] + 3, `right half: ${fromLeft[1]} then ${fromRight[1]}`)
  assert.match(await lightNow(page), /^99 % from the left, 60 % up/)
  withoutTrouble(page)
  await close(page)
})

test('a light taken by its handle does not leap', async () => {
  const page = await open()
  const before = await lightNow(page)
  const light = await page.locator('#light').boundingBox()
  await page.mouse.move(light.x + light.width / 2 + 6, light.y + light.height / 2 - 5)
  await page.mouse.down()
  await page.mouse.up()
  assert.equal(await lightNow(page), before)
  await close(page)
})

test('every preset and every sample can be chosen', async () => {
  const page = await open()
  const { presets } = await catalogue('/v1/presets')
  for (const { name, description } of presets) {
    await page.selectOption('#preset', name)
    assert.equal(await page.textContent('#sentence'), description)
    // An environment's final picture takes seconds; that previews of it come is claimed below.
    if (name !== 'ink') await rested(page)
    assert.equal(await message(page), '', name)
    if (['bas-relief', 'wax'].includes(name)) await keep(page, name)
  }
  const { samples } = await catalogue('/v1/samples')
  for (const sample of samples.filter(({ kind }) => kind === 'relief')) {
    await page.selectOption('#sample', sample.id)
    await rested(page)
    assert.equal(await message(page), '', sample.name)
    const box = await boxOf(page)
    assert.ok(Math.abs(box.width / box.height - sample.width / sample.height) < 0.02, 'the picture keeps its shape')
    await keep(page, sample.name)
  }
  withoutTrouble(page)
  await close(page)
})

test('an environment turns under the hand, and what does not apply to it is off', async () => {
  const page = await open()
  await page.selectOption('#preset', 'ink')
  await page.waitForFunction(() => document.getElementById('light').getAttribute('aria-valuetext').startsWith('turned'))
  assert.ok(await page.isDisabled('#distance'))
  assert.ok(await page.isDisabled('#light-color'))
  const yaw = async () => Number((await lightNow(page)).match(/^turned (-?\d+)°, tilted/)[1])
  const before = await yaw()
  const picture = page.waitForFunction(() => /^preview/.test(document.getElementById('timing').textContent))
  await drag(page, [0.3, 0.5], [0.55, 0.5])
  assert.ok(Math.abs((((await yaw()) - before + 360) % 360) - 90) <= 1, 'a quarter of the width is a quarter turn')
  await picture
  withoutTrouble(page)
  await keep(page, 'ink')
  await close(page)
})

test('a sun is dragged over a dome', async () => {
  const page = await open()
  await page.selectOption('#kind', 'directional')
  await drag(page, [0.5, 0.5], [0.75, 0.5])
  assert.equal(await lightNow(page), 'azimuth 90°, elevation 45°')
  assert.ok(await page.isDisabled('#distance'))
  assert.ok(await page.isVisible('#horizon'))
  await rested(page)
  assert.equal(await message(page), '')
  withoutTrouble(page)
  await close(page)
})

test('the keyboard moves the light and its distance', async () => {
  const page = await open()
  await page.locator('#light').focus()
  const [, x, y, z] = (await lightNow(page)).match(/(\S+) % .* (\S+) % up, (\S+) /).map(Number)
  await page.keyboard.press('ArrowRight')
  await page.keyboard.press('Shift+ArrowRight')
  await page.keyboard.press('ArrowDown')
  await page.keyboard.press('PageUp')
  const spoken = `${x + 12} % from the left, ${y - 2} % up, ${(z + 0.05).toFixed(2)} in front`
  assert.equal(await lightNow(page), spoken)
  await rested(page)
  assert.equal(await page.inputValue('#distance'), String(Number((z + 0.05).toFixed(2))))
  withoutTrouble(page)
  await close(page)
})

test('controls change the picture', async () => {
  const page = await open()
  const set = (id, value) => page.locator(id).evaluate((input, value) => {
    input.value = value
    input.dispatchEvent(new Event('input', { bubbles: true }))
  }, value)
  const before = await halves(page)
  await set('#intensity', 0.3)
  await rested(page)
  const dim = await halves(page)
  assert.ok(dim[0] < before[0] / 1.5, `${before[0]} then ${dim[0]}`)
  for (const [id, value] of [['#diffuse', '#336699'], ['#ks', 0.4], ['#kf', 0.2], ['#depth', -2], ['#relief', -0.5], ['#distance', 1.2]])
    await set(id, value)
  await page.check('#back')
  const sent = page.waitForRequest((request) => request.url().endsWith('/v1/render') && !request.postDataJSON().output.accuracy)
  await set('#base', '#101820')
  const scene = (await sent).postDataJSON()
  assert.deepEqual([scene.relief, scene.base, scene.material.depth, scene.material.specular.k, scene.material.scatter.k],
    [0.316, 'auto', 0.01, 0.4, 0.2])
  assert.deepEqual([scene.material.diffuseColor, scene.material.baseColor], ['#336699', '#101820'])
  assert.deepEqual([scene.lights[0].position[2], scene.lights[0].intensity], [1.2, 0.3])
  await rested(page)
  assert.equal(await message(page), '')
  await close(page)
})

test('a link shows the same again, and the download is the whole picture', async () => {
  const page = await open()
  await page.selectOption('#preset', 'bronze')
  await rested(page)
  await drag(page, [0.5, 0.5], [0.8, 0.2])
  await rested(page)
  await page.click('#link')
  await page.waitForFunction(() => /^The link is /.test(document.getElementById('message').textContent))
  const other = await open('/' + new URL(page.url()).hash)
  assert.equal(await lightNow(other), await lightNow(page))
  assert.deepEqual(await halves(other), await halves(page))
  const size = await page.locator('#download').evaluate(async (link) => {
    const reply = await fetch(link.href)
    const bitmap = await createImageBitmap(await reply.blob())
    return [reply.headers.get('Content-Type'), bitmap.width, bitmap.height]
  })
  assert.deepEqual(size, ['image/png', 512, 512])
  withoutTrouble(other)
  await close(page)
  await close(other)

  const broken = await open('/#scene=bm8')
  assert.equal(await message(broken), 'The link holds no scene.')
  assert.ok((await halves(broken))[0] > 10, 'a sample is shown instead')
  await close(broken)
})

test('a height map of one\'s own is lit, and a broken one is refused in a sentence', async () => {
  const page = await open()
  await page.setInputFiles('#file', join(repository, 'server/samples/pictures/plaster.jpg'))
  await rested(page)
  assert.equal(await message(page), '')
  assert.equal(await page.locator('#sample option:checked').textContent(), 'plaster.jpg')
  withoutTrouble(page)
  const light = await lightNow(page)

  const png = await readFile(join(repository, 'server/samples/plato.png'))
  await page.setInputFiles('#file', { name: 'half.png', mimeType: 'image/png', buffer: png.subarray(0, 9000) })
  await page.waitForFunction(() => /PNG file is broken/.test(document.getElementById('message').textContent))
  assert.equal(await lightNow(page), light, 'the picture before stays')

  const dropped = await page.evaluateHandle(() => {
    const transfer = new DataTransfer()
    transfer.items.add(new File(['no picture'], 'note.txt'))
    return transfer
  })
  await page.dispatchEvent('body', 'drop', { dataTransfer: dropped })
  await page.waitForFunction(() => /not an image/.test(document.getElementById('message').textContent))
  await keep(page, 'refused')
  await drag(page, [0.5, 0.5], [0.6, 0.4])
  await rested(page)
  assert.equal(await message(page), '')
  assert.equal(await page.locator('#sample option:checked').textContent(), 'plaster.jpg')
  await close(page)
})

test('on a phone the light follows the finger, and nothing is wider than the screen', async () => {
  const page = await open('/', { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true,
    deviceScaleFactor: 2, colorScheme: 'dark' })
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 360)
  const box = await boxOf(page)
  const session = await page.context().newCDPSession(page)
  const touch = (type, x, y) => session.send('Input.dispatchTouchEvent', {
    type, touchPoints: x == null ? [] : [{ x: box.x + x * box.width, y: box.y + y * box.height }] })
  await touch('touchStart', 0.5, 0.2)
  for (const y of [0.3, 0.5, 0.7]) await touch('touchMove', 0.5, y)
  await touch('touchEnd')
  assert.match(await lightNow(page), /^50 % from the left, 30 % up/)
  assert.equal(await page.evaluate(() => scrollY), 0, 'the page does not scroll under the finger')
  await rested(page)
  withoutTrouble(page)
  await keep(page, 'phone')
  await close(page)
})

test('when the server comes back the page goes on', async () => {
  const page = await open()
  await server.stop()
  await drag(page, [0.5, 0.5], [0.9, 0.1])
  await page.waitForFunction(() => document.getElementById('message').textContent === 'The server does not answer.')
  await server.start()
  await rested(page)
  assert.equal(await message(page), '')
  assert.match(await page.textContent('#timing'), /^final/)
  await close(page)
})

test('a full server is waited for', async () => {
  const page = await open()
  let full = true
  await page.route('**/v1/render', (route) => (full
    ? route.fulfill({ status: 503, headers: { 'Retry-After': '1' }, body: '{"detail":"Too many are waiting."}' })
    : route.continue()))
  await drag(page, [0.5, 0.5], [0.7, 0.3])
  await page.waitForFunction(() => document.getElementById('message').textContent === 'Too many are waiting.')
  full = false
  await rested(page)
  assert.equal(await message(page), '')
  await close(page)
})

test('/docs shows every call, field and problem of /openapi.json', async () => {
  const page = await open('/docs')
  await page.waitForSelector('#schema-Scene')
  const api = await catalogue('/openapi.json')
  const text = await page.textContent('main')
  const titles = await page.locator('h3').allTextContents()
  for (const [path, item] of Object.entries(api.paths))
    for (const method of ['get', 'post', 'delete'])
      if (item[method]) {
        assert.ok(titles.includes(method.toUpperCase() + path), `${method} ${path}`)
        if (item[method].summary) assert.ok(text.includes(item[method].summary), item[method].summary)
      }
  const fields = await page.locator('#schema-Scene td:first-child').allTextContents()
  for (const field of ['height', 'relief', 'material.specular.k', 'output.bitDepth']) assert.ok(fields.includes(field), field)
  const depth = page.locator('#schema-Scene tr', { has: page.locator('td:first-child', { hasText: /^material\.depth$/ }) })
  assert.match(await depth.textContent(), /number > 0, ≤ 10.*0\.008.*How far under the surface/)
  assert.ok(text.includes('queue-full'))
  for (const target of await page.locator('main a').evaluateAll((links) => links.map((link) => link.hash)))
    assert.equal(await page.locator(target).count(), 1, `the link to ${target}`)
  withoutTrouble(page)
  await keep(page, 'docs')
  await close(page)
})

test('/docs fits a phone, and says so when the description cannot be read', async () => {
  const phone = await open('/docs', { viewport: { width: 360, height: 740 } })
  await phone.waitForSelector('#schema-Scene')
  assert.equal(await phone.evaluate(() => document.documentElement.scrollWidth), 360)
  await keep(phone, 'docs-phone')
  await phone.route('**/openapi.json', (route) => route.abort())
  await phone.reload()
  await phone.waitForFunction(() => /could not be read/.test(document.getElementById('status')?.textContent))
  await close(phone)
})
