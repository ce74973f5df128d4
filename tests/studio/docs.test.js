// The description of the interface at /docs, in a real browser against a real server. Names are claims.
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { close, keep, openPage, staged, withoutTrouble } from './support.js'

const { server, browser } = await staged()
const open = (path, options) => openPage(browser, server.address + path, options)
const catalogue = async (path) => (await fetch(server.address + path)).json()

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
        const summary = item[method].summary?.replaceAll('`', '') ?? ''
        assert.ok(text.includes(summary), summary)
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
