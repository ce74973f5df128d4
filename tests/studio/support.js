// The real relitd and a real browser, for tests of the pages.
import assert from 'node:assert/strict'
import { spawn } from 'node:child_process'
import { once } from 'node:events'
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises'
import { createRequire } from 'node:module'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { createInterface } from 'node:readline'
import { after } from 'node:test'
import { chromium } from 'playwright-core'

/** relitd with a data folder of its own, which outlives stop() and start(). @param keys  text of its file of API keys */
export async function startServer({ keys } = {}) {
  const folder = await mkdtemp(join(tmpdir(), 'relit-page-'))
  let child
  const server = {
    port: 0,
    /** Of a server with keys: other ones, which it reads within a second or so. */
    setKeys: (text) => writeFile(join(folder, 'keys'), text, { mode: 0o600 }),
    async start() {
      const flags = ['--host', '127.0.0.1', '--port', String(server.port), '--data-dir', join(folder, 'data')]
      if (keys) flags.push('--api-keys', join(folder, 'keys'))
      child = spawn(process.env.RELITD, flags, { stdio: ['ignore', 'pipe', 'ignore'] })
      for await (const line of createInterface({ input: child.stdout })) {
        server.address = line.match(/^relitd listens on (\S+)/)?.[1]
        if (server.address) break
      }
      if (!server.address) throw new Error('relitd ended before it listened')
      server.port = Number(new URL(server.address).port)
    },
    async stop() {
      const ended = once(child, 'exit')
      child.kill('SIGTERM')
      await ended
    },
    async remove() {
      await server.stop()
      await rm(folder, { recursive: true })
    },
  }
  if (keys) await server.setKeys(keys)
  await server.start()
  process.on('exit', () => child.kill('SIGKILL'))
  return server
}

export function startBrowser() {
  const quiet = ['--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync']
  return chromium.launch({ executablePath: process.env.CHROMIUM, args: [...quiet, '--no-sandbox'] })
}

/** {server, browser} for all tests of a file, which are gone after the last of them. @param options  of the server */
export async function staged(options) {
  const stage = {}
  after(async () => {
    await stage.browser?.close()
    await stage.server?.remove()
  })
  stage.server = await startServer(options)
  stage.browser = await startBrowser()
  return stage
}

/**
 * A page with a list of all that a visitor must not meet: errors on the console, requests that failed or went elsewhere.
 * Renders that the page itself has given up are no failure.
 */
export async function openPage(browser, address, options) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options })
  const page = await context.newPage()
  page.setDefaultTimeout(10_000)
  page.troubles = []
  page.on('console', (message) => message.type() === 'error' && page.troubles.push(`console: ${message.text()}`))
  page.on('pageerror', (error) => page.troubles.push(`script: ${error.message}`))
  page.on('request', (request) => {
    const url = request.url()
    if (!url.startsWith(new URL(address).origin) && !url.startsWith('blob:')) page.troubles.push(`request to ${url}`)
  })
  page.on('requestfailed', (request) => {
    const error = request.failure().errorText
    if (error !== 'net::ERR_ABORTED') page.troubles.push(`${request.url()}: ${error}`)
  })
  await page.addInitScript(() => addEventListener('relit-frame', ({ detail: { final, etag, scene, width } }) => {
    if (final) globalThis.finalFrame = { etag, scene, width }
  }))
  await page.goto(address)
  return page
}

/**
 * Runs in a page: counts in `asked` what it fetches at once from addresses with this ending, and lists what is sent. A fetch
 * lasts until its reply is read or it has failed, as the page sees it: the browser's own events come late on a busy machine.
 */
export function countFetches(ending) {
  const count = (globalThis.asked = { now: 0, most: 0, bodies: [] })
  const { fetch } = globalThis
  const isOver = () => void --count.now
  globalThis.fetch = async (address, options) => {
    if (!String(address).endsWith(ending)) return fetch(address, options)
    count.most = Math.max(count.most, ++count.now)
    count.bodies.push(options?.body)
    const reply = await fetch(address, options).catch((error) => {
      isOver()
      throw error
    })
    for (const name of ['blob', 'json']) {
      const read = reply[name]
      reply[name] = () => read.call(reply).finally(isOver)
    }
    return reply
  }
}

/** How many renders the server has running or waiting. */
export async function rendersHeld({ address }) {
  const text = await (await fetch(address + '/metrics')).text()
  return [...text.matchAll(/^relit_renders_(?:running|waiting) (\d+)/gm)].reduce((sum, [, count]) => sum + Number(count), 0)
}

export const withoutTrouble = (page) => assert.deepEqual(page.troubles, [])
export const close = (page) => page.context().close()

/** A screenshot to look at, where the run was given a folder for them. */
export async function keep(page, name) {
  if (process.env.SCREENSHOTS) await page.screenshot({ path: join(process.env.SCREENSHOTS, `${name}.png`) })
}

/** The studio at a path of the server, with its first picture. */
export async function openStudio({ browser, server }, path = '/', options) {
  const page = await openPage(browser, server.address + path, options)
  await finalFrame(page)
  return page
}

/** The final picture is there, or the page says why not. */
export const rested = (page) => page.waitForSelector('#picture[aria-busy="false"]')
export const message = async (page) => ((await page.isVisible('#notice')) ? page.textContent('#message') : '')
export const says = (page, words) => page.waitForFunction((words) => new RegExp(words).test(document.getElementById('message').textContent), words)

/** The newest final picture: {etag, scene as it was asked for, width}. */
export async function finalFrame(page) {
  await page.waitForFunction(() => globalThis.finalFrame)
  await rested(page)
  return page.evaluate(() => globalThis.finalFrame)
}
/** The scene in the address, whole. */
export async function sceneNow(page, address) {
  // The address follows by a timer of the page's, once the scene rests: a later one of the same clock is due after it.
  const hash = await page.evaluate(() => new Promise((done) => setTimeout(() => done(location.hash), 400)))
  const scene = Buffer.from(hash.slice('#scene='.length), 'base64url').toString()
  const { light, ...whole } = await (await fetch(address + '/v1/scene', { method: 'POST', body: scene, headers: { 'Content-Type': 'application/json' } })).json()
  return light ? { ...whole, lights: [light] } : whole
}

/** What the picture shows, as [left, right, top, bottom]: mean brightness of its halves, 0 to 255. */
export const halves = (page) => page.evaluate(() => {
  const picture = document.getElementById('picture').shadowRoot.querySelector('canvas')
  const copy = Object.assign(document.createElement('canvas'), { width: 64, height: 64 })
  const context = copy.getContext('2d')
  context.drawImage(picture, 0, 0, 64, 64)
  const { data } = context.getImageData(0, 0, 64, 64)
  const sums = [0, 0, 0, 0]
  for (let y = 0; y < 64; ++y)
    for (let x = 0; x < 64; ++x) {
      const at = 4 * (64 * y + x)
      const brightness = ((data[at] + data[at + 1] + data[at + 2]) / 3) * (data[at + 3] / 255) / 2048
      sums[x < 32 ? 0 : 1] += brightness
      sums[y < 32 ? 2 : 3] += brightness
    }
  return sums
})

export const boxOf = (page) => page.locator('#picture').boundingBox()

/** Drags with the mouse from one place of the picture to another, both as shares of its size. */
export async function drag(page, from, to) {
  const box = await boxOf(page)
  const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height]
  await page.mouse.move(...at(from))
  await page.mouse.down()
  await page.mouse.move(...at(to), { steps: 8 })
  await page.mouse.up()
}

const axe = createRequire(import.meta.url).resolve('axe-core')

/** What axe finds that is serious: sentences. */
export async function violations(page) {
  await page.evaluate(await readFile(axe, 'utf8'))
  const { violations, passes } = await page.evaluate(() =>
    globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'best-practice'] }),
  )
  assert.ok(
    passes.some(({ id, nodes }) => id === 'color-contrast' && nodes.length),
    'contrast was looked at',
  )
  return violations
    .filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(
      ({ id, nodes }) =>
        `${id}: ${nodes
          .slice(0, 4)
          .map(({ html, failureSummary }) => `${html.slice(0, 160)} ${failureSummary}`)
          .join(' | ')}`,
    )
}
