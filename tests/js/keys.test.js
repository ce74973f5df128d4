// A server that asks for keys: the client in node, the element in a page of another origin. Names are claims.
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { Relit } from '../../clients/js/relit.js'
import { submit } from '../../clients/js/relit-jobs.js'
import { openSite, rested, stagedSite } from './pages.js'
import { plato } from './site.js'

const key = 'page-0123456789-._~+/='
const stage = await stagedSite({ keys: `${key} render\n` })
const { server } = stage
const scene = { height: { image: plato }, output: { width: 16 } }

test('every call of a client with a key is let in; without one, or with another, none is', async () => {
  const calls = {
    get: (client) => client.get('/v1/presets'),
    scene: (client) => client.scene(scene),
    render: (client) => client.render(scene, { session: 'a' }),
    upload: async (client) => client.upload(await (await client.fetch(`/v1/images/${plato}/content`)).blob()),
    batch: async (client) => {
      const batch = await submit(client, { scenes: [scene] })
      for await (const { event } of batch.events()) if (event === 'end') break
      await batch.frame(0)
      await batch.delete()
    },
  }
  for (const [name, call] of Object.entries(calls)) {
    await call(new Relit(server.address, { key }))
    await assert.rejects(call(new Relit(server.address)), { status: 401, code: 'unauthorized', temporary: false }, name)
    await assert.rejects(call(new Relit(server.address, { key: key + 'x' })), { status: 401 }, name)
  }
})

test("a call's own headers go along with the key", async () => {
  const client = new Relit(server.address, { key })
  const headers = new Headers({ 'Content-Type': 'application/json', 'Idempotency-Key': 'twice' })
  const post = () => client.get('/v1/batches', { method: 'POST', body: JSON.stringify({ scenes: [scene] }), headers })
  assert.equal((await post()).id, (await post()).id)
})

test('an element with the key shows its picture; one without is told, and begins when it is given', async () => {
  const page = await openSite(stage, `<relit-image src="${plato}"></relit-image>`)
  page.expectTroubles = true // the browser itself puts a refusal on the console
  const [refused] = await page.evaluate(() => seen.errors)
  assert.deepEqual([refused.status, refused.code, refused.again], [401, 'unauthorized', null])
  await page.locator('relit-image').evaluate((image, key) => image.setAttribute('key', key), key)
  await page.waitForFunction(() => seen.recoveries === 1)
  await rested(page)
  await page.done()

  const keyed = await openSite(stage, `<relit-image src="${plato}" key="${key}" preset="wax"></relit-image>`)
  assert.equal((await keyed.evaluate(() => seen.frames.at(-1))).final, true)
  await keyed.done()
})

test('an upload with progress sends the key', async () => {
  const page = await openSite(stage, `<relit-image src="${plato}" key="${key}"></relit-image>`)
  const id = await page.evaluate(async ([server, plato]) => {
    const { client } = document.querySelector('relit-image')
    const { upload } = await import(server + '/relit-jobs.js')
    return (await upload(client, await (await client.fetch(`/v1/images/${plato}/content`)).blob())).id
  }, [server.address, plato])
  assert.equal(id, plato)
  await page.done()
})
