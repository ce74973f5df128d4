// Takes the pictures of the studio that README.md shows: a window, and the frames of a drag. Started by `pictures`.
import { join } from 'node:path'
import { finalFrame, openStudio, rested, startBrowser, startServer } from './support.js'

const folder = process.argv[2]
const server = await startServer()
const browser = await startBrowser()
const open = async (options) => {
  const page = await openStudio({ browser, server }, '/', { colorScheme: 'dark', ...options })
  await page.click('#hint-close')
  return page
}
const choose = async (page, card) => {
  await page.click(card)
  await page.waitForSelector(`${card}[aria-pressed="true"]`)
  await rested(page)
}

const window = await open({ viewport: { width: 1440, height: 900 } })
await choose(window, '#looks [data-name="bronze"]')
await window.keyboard.press('x')
await window.waitForFunction(() => document.getElementById('cut').textContent)
await window.waitForFunction(() => document.querySelectorAll('#looks img:not(.there)').length === 0, null, {
  timeout: 60_000,
})
await window.locator('#probe').focus()
for (const key of ['Right', 'Right', 'Right', 'Right', 'Down', 'Down', 'Down'])
  await window.keyboard.press(`Shift+Arrow${key}`) // into a shadow
await window.evaluate(() => document.activeElement.blur())
await rested(window)
await window.screenshot({ path: join(folder, 'studio.png') })

// One turn of a low sun, as a hand drags it: each frame is taken when its picture is there.
const page = await open({ viewport: { width: 1180, height: 760 } })
await page.click('#reliefs .card:last-child')
await page.waitForFunction(() => document.getElementById('title').textContent.startsWith('Mount'))
await finalFrame(page)
await page.keyboard.press('x')
await page.waitForFunction(() => document.getElementById('cut').textContent)
await page.keyboard.press('+')
await rested(page)
await page.evaluate(() => {
  globalThis.shown = document.getElementById('picture').scene.lights[0].azimuth
  addEventListener('relit-frame', ({ detail }) => (globalThis.shown = detail.scene.lights[0].azimuth))
})
const box = await page.locator('#picture').boundingBox()
const clip = await page.locator('#work').boundingBox()
const radius = (Math.min(box.width, box.height) / 2) * 0.8
const frames = 48
const begin = 300 // degrees: where the sun of this sample stands
const at = (turn) => [box.x + box.width / 2 + radius * Math.sin(turn), box.y + box.height / 2 - radius * Math.cos(turn)]
for (let i = 0; i < frames; ++i) {
  const azimuth = (begin + (i / frames) * 360) % 360
  const turn = (azimuth * Math.PI) / 180
  await page.mouse.move(...at(turn))
  if (!i) await page.mouse.down()
  await page.waitForFunction((azimuth) => Math.abs(((globalThis.shown - azimuth + 540) % 360) - 180) < 1, azimuth)
  await page.screenshot({
    path: join(folder, `${String(i).padStart(3, '0')}.png`),
    clip: { ...clip, height: clip.height - 40 },
  })
}
await page.mouse.up()
await browser.close()
await server.remove()
