// The studio when its server is away or full, in a real browser. Names are claims.
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { close, drag, openStudio, rested, says, staged } from './support.js'

const stage = await staged()
const { server } = stage
const open = () => openStudio(stage)

test('when the server goes away that is said with what to do, and when it comes back the studio goes on', async () => {
  const page = await open()
  await server.stop()
  await drag(page, [0.5, 0.5], [0.9, 0.1])
  await says(page, '^The server does not answer. Is it running\\? Trying again')
  await server.start()
  await rested(page)
  await page.waitForSelector('#notice', { state: 'hidden' })
  assert.match(await page.textContent('#timings'), /^final/)
  await close(page)
})

test('a full server is waited for', async () => {
  const page = await open()
  let full = true
  await page.route('**/v1/render', (route) =>
    full
      ? route.fulfill({
          status: 503,
          headers: { 'Retry-After': '1' },
          body: '{"type":"/problems/queue-full","detail":"Too many are waiting."}',
        })
      : route.continue(),
  )
  await drag(page, [0.5, 0.5], [0.7, 0.3])
  await says(page, '^Too many are waiting')
  full = false
  await rested(page)
  await page.waitForSelector('#notice', { state: 'hidden' })
  await close(page)
})
