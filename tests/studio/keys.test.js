// The studio of a server that asks for keys, in a real browser. Names are claims.
import assert from 'node:assert/strict'
import { readFile } from 'node:fs/promises'
import { test } from 'node:test'
import { close, drag, finalFrame, keep, openPage, rested, says, staged, violations } from './support.js'

const key = 'studio-0123456789-._~+/='
const reader = 'reader-0123456789'
const { server, browser } = await staged({ keys: `${key} render\n${reader} read\n` })

const open = () => openPage(browser, server.address + '/')
const asked = (page, why) => page.locator('#key-why', { hasText: why }).waitFor()
const give = async (page, text) => {
  await page.fill('#key-value', text)
  await page.click('#key button[type=submit]')
}
const opened = async () => {
  const page = await open()
  await give(page, key)
  await finalFrame(page)
  return page
}

test('the studio asks for a key until one is good, and goes on where it was', async () => {
  const page = await open()
  await asked(page, 'This server asks for one.')
  await keep(page, 'key')
  assert.deepEqual(await violations(page), [])
  await give(page, 'short')
  assert.ok(await page.isVisible('#key'), 'that is no key')
  await give(page, 'unknown-0123456789')
  await asked(page, 'The server does not know this API key.')
  await give(page, reader)
  await asked(page, /needs a key of scope render; this one's is read/)
  await give(page, `  ${key} `)
  await finalFrame(page)
  assert.ok(!(await page.isVisible('#key')))
  await close(page)
})

test('what the studio sends has the key: thumbnails, an upload, the section, the file', async () => {
  const page = await opened()
  const refused = []
  page.on('response', (reply) => reply.status() === 401 && refused.push(reply.url()))
  await page.waitForFunction(() => {
    const images = [...document.querySelectorAll('#looks img')]
    return images.length > 5 && images.every((img) => img.className === 'there' && img.naturalWidth)
  }, null, { timeout: 60_000 })
  await page.setInputFiles('#file', { name: 'a.png', mimeType: 'image/png', buffer: await readFile(new URL('../../server/samples/fish.png', import.meta.url)) })
  await says(page, '^a.png is the height map')
  await rested(page)
  await page.keyboard.press('x')
  await page.waitForFunction(() => /r = /.test(document.getElementById('cut').textContent))
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#download')])
  assert.ok((await readFile(await download.path())).subarray(1, 4).equals(Buffer.from('PNG')))
  assert.deepEqual(refused, [])
  await close(page)
})

test('the key is kept in its tab, and in nothing that leaves it', async () => {
  const page = await opened()
  await page.reload()
  await finalFrame(page)
  assert.ok(!(await page.isVisible('#key')))
  await page.click('#copy-as')
  assert.ok(!(await page.inputValue('#snippet')).includes(key))
  for (const title of ['curl', '<img>', '<relit-image>', 'relit']) {
    await page.locator('#snippet-kinds').getByText(title, { exact: true }).click()
    const text = await page.inputValue('#snippet')
    assert.ok(!text.includes(key) && text.includes('"Authorization: Bearer $RELIT_API_KEY"') === (title === 'curl'), text)
    assert.match(await page.textContent('#snippet-note'), /key/, title)
  }
  const left = await page.evaluate(() => location.href + JSON.stringify(localStorage) + document.cookie)
  assert.ok(!left.includes(key))
  const other = await page.context().newPage()
  await other.goto(server.address)
  await asked(other, 'This server asks for one.')
  await close(page)
})

test('who gives no key is told how to be asked again', async () => {
  const page = await open()
  await asked(page, 'This server asks for one.')
  await page.keyboard.press('Escape')
  await says(page, 'This needs an API key.* Load the page again to give one.')
  await page.reload()
  await page.click('#key-leave')
  await says(page, 'Load the page again')
  await close(page)
})

test('where its key is withdrawn, the studio asks for another one and shows what was asked for meanwhile', async () => {
  const page = await opened()
  const other = 'another-0123456789'
  await server.setKeys(`${other} render\n`)
  for (let x = 0.2; x < 0.8 && !(await page.isVisible('#key')); x += 0.02) {
    await drag(page, [0.5, 0.5], [x, 0.5])
    await page.waitForTimeout(300)
  }
  await asked(page, 'The server does not know this API key.')
  await give(page, other)
  await rested(page)
  const { scene } = await finalFrame(page)
  const wanted = await page.evaluate(() => document.getElementById('picture').scene.lights[0].position)
  assert.deepEqual(scene.lights[0].position, wanted)
  await close(page)
})
