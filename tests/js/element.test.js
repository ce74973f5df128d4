// <relit-image> in a real browser, in a page of another origin than the server's. Names are claims.
import assert from 'node:assert/strict'
import { readFile } from 'node:fs/promises'
import { test } from 'node:test'
import { keep } from '../studio/support.js'
import { boxOf, brightness, light, openSite, rested, stagedSite } from './pages.js'
import { plato, startProxy } from './site.js'

const stage = await stagedSite()
const { server, pages } = stage
pages['/relief.png'] = ['image/png', await readFile(new URL('../../server/samples/fish.png', import.meta.url))]

const open = (tag, options) => openSite(stage, tag, options)
const element = (page, work, argument) => page.locator('relit-image').evaluate(work, argument)

test('the light comes to the mouse, and the brightest side of the relief follows it', async () => {
  const page = await open(`<relit-image src="${plato}" alt="A bust" light="0.5,0.5,0.3"></relit-image>`)
  const box = await boxOf(page)
  const seen = {}
  for (const [name, x, y] of [['left', 0.05, 0.5], ['right', 0.95, 0.5], ['top', 0.5, 0.05], ['bottom', 0.5, 0.95]]) {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2)
    await page.mouse.down()
    await page.mouse.move(box.x + x * box.width, box.y + y * box.height, { steps: 6 })
    await page.mouse.up()
    await rested(page)
    seen[name] = await brightness(page)
    const [left, up] = (await light(page)).position
    assert.ok(Math.abs(left - x) < 0.01 && Math.abs(up - (1 - y)) < 0.01, `the light is at ${left}, ${up}`)
  }
  const { left, right, top, bottom } = seen
  assert.ok(left.left > right.left + 0.1 && top.top > bottom.top + 0.1, JSON.stringify(seen))
  await keep(page, 'element')
  await page.done()
})

test('a light that is taken by its handle does not jump', async () => {
  const page = await open(`<relit-image src="${plato}" light="0.5,0.5,0.3"></relit-image>`)
  const box = await boxOf(page)
  await page.mouse.move(box.x + box.width / 2 + 6, box.y + box.height / 2 - 5)
  await page.mouse.down()
  await page.mouse.move(box.x + box.width / 2 + 46, box.y + box.height / 2 - 5, { steps: 3 })
  await page.mouse.up()
  const [x, y] = (await light(page)).position
  assert.ok(Math.abs(x - 0.5 - 40 / box.width) < 0.003 && y === 0.5, `${x}, ${y}`)
  await page.done()
})

test('a finger drags the light and does not scroll the page; a second finger changes nothing', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image><p style="height:3000px">`, { hasTouch: true, isMobile: true, viewport: { width: 390, height: 800 } })
  const box = await boxOf(page)
  const touch = await page.context().newCDPSession(page)
  const points = (...at) => at.map(([x, y], id) => ({ x: box.x + x * box.width, y: box.y + y * box.height, id }))
  const send = (type, ...at) => touch.send('Input.dispatchTouchEvent', { type, touchPoints: points(...at) })
  await send('touchStart', [0.5, 0.2])
  await send('touchMove', [0.5, 0.6])
  await send('touchStart', [0.5, 0.6], [0.1, 0.1])
  await send('touchMove', [0.25, 0.75], [0.9, 0.1])
  await send('touchEnd')
  await rested(page)
  assert.deepEqual((await light(page)).position.slice(0, 2).map((share) => Math.round(share * 100)), [25, 25])
  assert.equal(await page.evaluate(() => scrollY), 0)
  await page.done()
})

test('keys move the light and its distance; a screen reader hears where it is', async () => {
  const page = await open(`<relit-image src="${plato}" light="0.5,0.5,0.5"></relit-image>`)
  const slider = page.getByRole('slider', { name: 'Light' })
  await slider.focus()
  const press = async (...keys) => {
    for (const key of keys) await page.keyboard.press(key)
    return (await light(page)).position
  }
  assert.deepEqual(await press('ArrowRight', 'ArrowUp', 'ArrowUp'), [0.52, 0.54, 0.5])
  assert.deepEqual(await press('Shift+ArrowLeft', 'Shift+ArrowDown'), [0.42, 0.44, 0.5])
  assert.deepEqual(await press('PageUp', 'Shift+PageDown'), [0.42, 0.44, 0.42])
  assert.deepEqual(await press('Control+ArrowLeft', 'Alt+ArrowUp', 'a'), [0.42, 0.44, 0.42])
  assert.equal(await slider.getAttribute('aria-valuetext'), '42 % from the left, 44 % up, 0.42 near')
  assert.equal(await slider.getAttribute('aria-valuenow'), '42')
  await rested(page)
  await page.done()
})

test('the picture has its alternative text', async () => {
  const page = await open(`<relit-image src="${plato}" alt="A bust"></relit-image>`)
  await page.getByRole('img', { name: 'A bust' }).waitFor()
  await page.done()
})

test('an environment turns from where it is taken, and its arrow keys turn it', async () => {
  const samples = await (await fetch(server.address + '/v1/samples')).json()
  const sky = samples.samples.find(({ kind }) => kind === 'environment').id
  const page = await open(`<relit-image src="${plato}" env="${sky},0,0"></relit-image>`)
  const box = await boxOf(page)
  await page.mouse.move(box.x + 0.1 * box.width, box.y + 0.3 * box.height)
  await page.mouse.down()
  assert.deepEqual((await light(page)).rotation, [0, 0])
  await page.mouse.move(box.x + 0.35 * box.width, box.y + 0.4 * box.height, { steps: 4 })
  await page.mouse.up()
  await rested(page)
  const turned = (await light(page)).rotation.map(Math.round)
  assert.deepEqual(turned, [90, 18])
  await page.keyboard.press('ArrowRight')
  assert.equal(Math.round((await light(page)).rotation[0]), 97)
  await rested(page)
  await page.done()
})

test('a sun is dragged over a dome', async () => {
  const page = await open(`<relit-image src="${plato}" sun="315,35"></relit-image>`)
  const box = await boxOf(page)
  await page.mouse.click(box.x + 0.75 * box.width, box.y + 0.5 * box.height)
  const { azimuth, elevation } = await light(page)
  assert.ok(Math.abs(azimuth - 90) < 1 && Math.abs(elevation - 45) < 1, `${azimuth}, ${elevation}`)
  await page.done()
})

test('a relief of the page\'s own is uploaded; a preset and a scene lie under it', async () => {
  const page = await open(`<relit-image src="relief.png" preset="jade" scene='{"relief": 0.3}'></relit-image>`)
  const [scene, map] = await element(page, ({ scene, map }) => [scene, map])
  assert.equal(scene.relief, 0.3)
  assert.equal(scene.material.illumination, 'exponential')
  const { id } = await (await fetch(`${server.address}/v1/images/${scene.height.image}`)).json()
  assert.equal(map.id, id)
  await page.done()
})

test('the picture at rest is the final one of its scene, in device pixels', async () => {
  const page = await open(`<relit-image src="${plato}" style="width:300px"></relit-image>`, { deviceScaleFactor: 2 })
  const frame = await page.evaluate(() => seen.frames.at(-1))
  assert.deepEqual([frame.final, frame.width, frame.height, frame.accuracy], [true, 600, 600, 'final'])
  const scene = await element(page, ({ scene }) => scene)
  const asked = { ...scene, output: { ...scene.output, format: 'png', effort: 'fast', width: 600 } }
  const dry = await fetch(server.address + '/v1/scene', { method: 'POST', body: JSON.stringify(asked) })
  assert.equal(frame.etag, dry.headers.get('ETag'))
  await element(page, (image) => { image.style.width = '200px' })
  await page.waitForFunction(() => seen.frames.at(-1).width === 400 && seen.frames.at(-1).final)
  await page.done()
})

test('a scene may be set: another light, a layer, a region whose points are the map\'s', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`)
  await element(page, (image) => {
    const output = { ...image.scene.output, layer: 'normal', region: [256, 128, 256, 128] }
    image.scene = { ...image.scene, lights: [{ type: 'directional' }, { type: 'point', position: [0.75, 0.75, 0.4] }], output }
  })
  await rested(page)
  const box = await boxOf(page)
  assert.ok(Math.abs(box.width / box.height - 2) < 0.02)
  await page.mouse.click(box.x + 1, box.y + box.height - 1)
  const [index, position] = await element(page, (image) => [image.active, image.scene.lights[1].position])
  assert.deepEqual([index, ...position.map((share) => Math.round(share * 50) / 50)], [1, 0.5, 0.5, 0.4])
  await element(page, (image) => { image.active = 0 })
  assert.equal(await page.getByRole('slider').getAttribute('aria-valuetext'), 'azimuth 315°, elevation 35°')
  await rested(page)
  await page.done()
})

test('relit-light tells every move and then once that the hand rests', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`)
  const box = await boxOf(page)
  await page.mouse.move(box.x + 50, box.y + 50)
  await page.mouse.down()
  await page.mouse.move(box.x + 90, box.y + 90, { steps: 4 })
  await page.mouse.up()
  await rested(page)
  const told = await page.evaluate(() => seen.lights.map(({ rest }) => (rest ? 'rest' : 'move')).join(' '))
  assert.match(told, /^(move (move )*rest ?)+$/) // several rests where the machine pauses between the moves
  await page.done()
})

test('a page that takes an event for itself keeps it', async () => {
  const page = await open(`<relit-image src="${plato}" light="0.5,0.5,0.5"></relit-image>`)
  await element(page, (image) => image.addEventListener('pointerdown', (event) => event.preventDefault(), true))
  const box = await boxOf(page)
  await page.mouse.click(box.x + 10, box.y + 10)
  assert.deepEqual((await light(page)).position, [0.5, 0.5, 0.5])
  await page.done()
})

test('an element that moves in its page, or is hidden for a while, goes on with its scene', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image><main></main>`)
  await page.mouse.click(200, 200)
  await rested(page)
  const before = await light(page)
  await element(page, (image) => document.querySelector('main').append(image))
  await rested(page)
  assert.deepEqual(await light(page), before)
  await element(page, (image) => { image.hidden = true })
  await element(page, (image) => { image.scene = { ...image.scene, relief: 0.4 }; image.hidden = false })
  await page.waitForFunction(() => seen.frames.at(-1).final && seen.frames.at(-1).relief === 0.4)
  await element(page, (image) => { // hidden and back before anybody has drawn the page
    image.hidden = true
    image.scene = { ...image.scene, relief: 0.3 }
    image.hidden = false
  })
  await page.waitForFunction(() => seen.frames.at(-1).final && seen.frames.at(-1).relief === 0.3)
  await page.done()
})

test('what the server refuses is told once, and the next scene is shown', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`)
  page.expectTroubles = true // the browser itself puts a refusal on the console
  await element(page, (image) => { image.scene = { ...image.scene, relief: -1 } })
  await rested(page)
  const [error] = await page.evaluate(() => seen.errors)
  assert.deepEqual([error.status, error.code, error.again], [422, 'invalid-value', null])
  await element(page, (image) => { image.scene = { ...image.scene, relief: 0.2 } })
  await page.waitForFunction(() => seen.frames.at(-1).final && seen.frames.at(-1).relief === 0.2)
  assert.deepEqual(await page.evaluate(() => [seen.errors.length > 0, seen.recoveries]), [true, 1])
  await page.done()
})

test('an image that does not answer is asked for six times, one that is not there once, and then another is shown', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`)
  page.expectTroubles = true // the browser itself puts what failed on the console
  const given = async (src) => {
    await element(page, (image, src) => { image.setAttribute('src', src) }, src)
    await page.waitForFunction(() => seen.errors.at(-1)?.again === null, null, { timeout: 30_000 })
    await rested(page)
    return page.evaluate(() => seen.errors.splice(0))
  }
  const away = 'http://127.0.0.1:1/relief.png'
  const told = await given(away)
  assert.deepEqual(told.map(({ again }) => again), [250, 500, 1000, 2000, 4000, null])
  assert.ok(told.every(({ status, message }) => status === 0 && message === away + ' does not answer.'))
  assert.deepEqual((await given('none.png')).map(({ status }) => status), [404])
  await element(page, (image) => { image.setAttribute('src', 'relief.png') })
  await page.waitForFunction(() => seen.recoveries === 1)
  await rested(page)
  assert.ok((await page.evaluate(() => seen.frames.at(-1))).final)
  await page.done()
})

test('latest wins: one request under way, and every picture that is shown is newer than the one before', async () => {
  const proxy = await startProxy(server.address)
  proxy.delay_ms = 40
  const page = await open(`<relit-image src="${plato}"></relit-image>`, { server: proxy.address })
  const box = await boxOf(page)
  await page.mouse.move(box.x, box.y + 10)
  await page.mouse.down()
  for (let x = 0; x < 60; ++x) {
    await page.mouse.move(box.x + 5 * x, box.y + 10)
    if (x === 30) await page.waitForTimeout(250) // a rest in the middle: the final picture, left when it goes on
  }
  await page.mouse.up()
  await rested(page)
  const [session] = proxy.sessions.values()
  assert.equal(proxy.sessions.size, 1)
  const { lights, frames } = await page.evaluate(() => seen)
  assert.equal(await page.evaluate(() => asked.most), 1)
  assert.ok(session.most <= 2) // the proxy may hear of the next request before it hears that one was given up
  assert.ok(session.all < lights.length, `${session.all} renders for ${lights.length} moves`)
  const shown = frames.slice(1).map(({ x }) => x)
  assert.deepEqual(shown, [...shown].sort((a, b) => a - b))
  assert.equal(shown.at(-1), (await light(page)).position[0])
  proxy.close()
  await page.done()
})

test('under a policy that allows nothing inline, with reduced motion, nothing is missing', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`, { reducedMotion: 'reduce', policy: true })
  assert.equal(await page.locator('relit-image').evaluate((image) => getComputedStyle(image).display), 'block')
  assert.equal(await element(page, (image) => image.shadowRoot.querySelector('b').getAnimations().length), 0)
  await page.done()
})

test('an upload tells how far it is, what is refused is a RelitError, and it can be left', async () => {
  const page = await open(`<relit-image src="${plato}"></relit-image>`)
  page.expectTroubles = true // the browser itself puts a refusal on the console
  const told = await page.evaluate(async (server) => {
    const { upload } = await import(server + '/relit-jobs.js')
    const { Relit, RelitError } = await import(server + '/relit.js')
    const client = new Relit(server)
    const relief = await (await fetch('relief.png')).blob()
    const progress = []
    const { width } = await upload(client, relief, { progress: (sent, total) => progress.push([sent, total]) })
    const refused = await upload(client, new Blob(['no image'])).catch((error) => error)
    const leave = new AbortController()
    const left = upload(client, new Blob([new Uint8Array(20e6)]), { signal: leave.signal }).catch((error) => error)
    leave.abort()
    const away = await upload(new Relit('http://127.0.0.1:1'), relief).catch((error) => error)
    return {
      width, last: progress.at(-1), size: relief.size,
      refused: [refused instanceof RelitError, refused.status, refused.code],
      left: (await left).name, away: [away instanceof RelitError, away.status, away.temporary],
    }
  }, server.address)
  assert.deepEqual(told.last, [told.size, told.size])
  assert.ok(told.width > 0)
  assert.deepEqual(told.refused, [true, 415, 'image-not-supported'])
  assert.equal(told.left, 'AbortError')
  assert.deepEqual(told.away, [true, 0, true])
  await page.done()
})
