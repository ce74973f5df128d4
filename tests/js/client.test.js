// The client of clients/js against a real server, in node. Names are claims.
import assert from 'node:assert/strict'
import { readFile } from 'node:fs/promises'
import { createServer } from 'node:http'
import { once } from 'node:events'
import { after, before, test } from 'node:test'
import { Relit, RelitError } from '../../clients/js/relit.js'
import { Batch, submit } from '../../clients/js/relit-jobs.js'
import { rendersHeld, startServer } from '../studio/support.js'
import { plato } from './site.js'

let server
let client
before(async () => {
  server = await startServer()
  client = new Relit(server.address + '/')
})
after(() => server?.remove())

const scene = { height: { image: plato }, output: { width: 32 } }
const refusal = (work) => work.then(() => assert.fail('it was no failure'), (error) => error)
const isPng = async (blob) => assert.equal(Buffer.from(await blob.slice(1, 4).arrayBuffer()).toString(), 'PNG')

test('an upload is named by its bytes, whatever they come as', async () => {
  const bytes = await readFile(new URL('../../server/samples/plato.png', import.meta.url))
  for (const image of [new Blob([bytes], { type: 'image/png' }), bytes, new Uint8Array(bytes).buffer]) {
    const info = await client.upload(image)
    assert.deepEqual([info.id, info.width, info.channels], [plato, 512, 2])
  }
})

test('a picture comes with its ETag, its accuracy and its times, which add up', async () => {
  const picture = await client.render(scene)
  await isPng(picture.blob)
  assert.match(picture.etag, /^"[0-9a-f]+"$/)
  assert.equal(picture.accuracy, 'final')
  const { total, network, transfer, ...stages } = picture.timing
  assert.deepEqual(Object.keys(stages).sort(), ['decode', 'encode', 'parse', 'queue', 'render'])
  const served = Object.values(stages).reduce((sum, ms) => sum + ms)
  assert.ok(Math.abs(served + network - total) < 1e-6 && transfer >= 0 && transfer <= total)
})

test('a dry run is the whole scene and the ETag of its picture', async () => {
  const { scene: whole, etag } = await client.scene(scene)
  assert.equal(whole.material.depth, 0.008)
  assert.equal(whole.light.type, 'point')
  assert.equal(etag, (await client.render(whole)).etag)
})

test('the address of a picture is the same picture, whatever the length of its scene', async () => {
  for (const width of [8, 24, 100]) {
    const wanted = { ...scene, preset: 'wax', relief: 0.125, output: { width, background: '#123456' } }
    const got = await fetch(client.url(wanted))
    assert.equal(got.headers.get('ETag'), (await client.render(wanted)).etag)
  }
})

test('the address of a scene holds every character, and all that base64 has for them', async () => {
  for (const name of ['Flöte, 笛, 🎶', '>>>???', '??>>>'])
    for (const end of ['', ' ', '  ']) {
      const strange = { ...scene, [name + end]: 1 } // no field: its name is in the refusal
      const { detail } = await (await fetch(client.url(strange))).json()
      assert.ok(detail.includes(name + end), detail)
      assert.equal(detail, (await refusal(client.render(strange))).message)
    }
})

test('a refusal is an error with the problem document', async () => {
  const error = await refusal(client.render({ ...scene, material: { depth: 0 } }))
  assert.ok(error instanceof RelitError && error instanceof Error)
  assert.deepEqual([error.status, error.code, error.problem.pointer, error.temporary], [422, 'invalid-value', '/material/depth', false])
  assert.match(error.message, /^'material\.depth' must be/)
  assert.equal((await refusal(client.get('/v1/images/' + '0'.repeat(64)))).code, 'not-found')
})

test('no answer is an error that may pass; so is a busy server, which says when', async () => {
  const error = await refusal(new Relit('http://127.0.0.1:1').get('/v1/presets'))
  assert.deepEqual([error.status, error.temporary, error.message], [0, true, 'The server does not answer.'])

  const busy = createServer((request, reply) => reply.writeHead(503, { 'Retry-After': 7 }).end('<html>'))
  busy.listen(0, '127.0.0.1')
  await once(busy, 'listening')
  const full = await refusal(new Relit(`http://127.0.0.1:${busy.address().port}`).render(scene))
  assert.deepEqual([full.status, full.temporary, full.retryAfter, full.message], [503, true, 7, 'Status 503'])
  busy.close()
})

test('an aborted call is an AbortError', async () => {
  const abort = new AbortController()
  const call = refusal(client.render(scene, { signal: abort.signal }))
  abort.abort()
  assert.equal((await call).name, 'AbortError')
})

test('a newer render of a session stops the older one', async () => {
  const slow = { height: { image: plato }, output: { width: 2048 }, material: { illumination: 'count', steps: 5000 } }
  while (await rendersHeld(server)); // of the test before
  const older = refusal(client.render(slow, { session: 'a-view' }))
  while (!(await rendersHeld(server)));
  await client.render(scene, { session: 'a-view' })
  const error = await older
  assert.deepEqual([error.status, error.code], [409, 'superseded'])
})

test('a batch: submitted once by its key, its events, its frames, its end', async () => {
  const request = { scene, sweep: { path: 'orbit', count: 5, elevation: 30 } }
  const batch = await submit(client, request, { key: 'five' })
  assert.equal((await submit(client, request, { key: 'five' })).id, batch.id)
  const events = []
  for await (const event of batch.events()) events.push(event)
  assert.equal(events.at(-1).event, 'end')
  const frames = events.slice(0, -1)
  assert.deepEqual(frames.map(({ frame }) => frame).sort(), [0, 1, 2, 3, 4])
  assert.ok(frames.every(({ event, status, bytes }) => event === 'frame' && status === 'done' && bytes > 0))

  const rest = []
  for await (const event of batch.events({ after: events[2].id })) rest.push(event)
  assert.deepEqual(rest, events.slice(3))
  const end = []
  for await (const event of batch.events({ after: events.at(-1).id })) end.push(event.event)
  assert.deepEqual(end, ['end'])

  await isPng(await batch.frame(3))
  assert.deepEqual([(await batch.status()).done, (await batch.retry()).failed], [5, 0])
  assert.equal((await fetch(batch.archive('zip'))).headers.get('Content-Type'), 'application/zip')
  await new Batch(client, batch.id).delete()
  assert.equal((await refusal(batch.status())).status, 404)
})

test('events go on over a server that stops and comes back: each frame once', async () => {
  const slow = { height: { image: plato }, material: { illumination: 'count', steps: 2000 }, output: { width: 256 } }
  const batch = await submit(client, { scene: slow, sweep: { path: 'line', count: 12, from: [0, 0, 1], to: [1, 1, 1] } })
  const frames = []
  let restarted = null
  for await (const event of batch.events()) {
    if (event.event === 'frame') frames.push(event.frame)
    restarted ??= server.stop().then(() => server.start())
  }
  await restarted
  assert.deepEqual(frames.sort((a, b) => a - b), Array.from({ length: 12 }, (_, i) => i))
  await batch.delete()
})

test('a submission that the server misses is repeated; a refused one is not', async () => {
  await server.stop()
  const late = submit(client, { scenes: [scene] })
  await server.start()
  assert.equal((await (await late).status()).total, 1)
  assert.equal((await refusal(submit(client, { scenes: [{}] }))).status, 422)
})

test('leaving the events ends them', async () => {
  const batch = await submit(client, { scene, sweep: { path: 'orbit', count: 50 } })
  for await (const event of batch.events()) if (event.event) break
  const abort = new AbortController()
  abort.abort()
  await assert.rejects(batch.events({ signal: abort.signal }).next(), { name: 'AbortError' })
  await batch.delete()
})

test('the modules may be imported by pages of any origin, and are asked for anew only where they differ', async () => {
  for (const name of ['relit.js', 'relit-jobs.js']) {
    const address = `${server.address}/${name}`
    const reply = await fetch(address, { headers: { Origin: 'https://elsewhere.example' } })
    assert.equal(await reply.text(), await readFile(new URL('../../clients/js/' + name, import.meta.url), 'utf8'))
    const header = (name) => reply.headers.get(name)
    assert.match(header('Content-Type'), /^text\/javascript/)
    assert.deepEqual([header('Access-Control-Allow-Origin'), header('Cache-Control')], ['*', 'no-cache'])
    const again = await fetch(address, { headers: { 'If-None-Match': header('ETag') }, cache: 'no-store' })
    assert.equal(again.status, 304)
  }
})

test('pages of any origin may send what the client sends and read what it reads, after one preflight in two hours', async () => {
  const preflight = await fetch(server.address + '/v1/render', {
    method: 'OPTIONS',
    headers: { 'Origin': 'https://elsewhere.example', 'Access-Control-Request-Method': 'POST' },
  })
  const list = (reply, name) => (reply.headers.get(name) ?? '').toLowerCase().split(/, */)
  for (const name of ['content-type', 'relit-session', 'idempotency-key', 'last-event-id'])
    assert.ok(list(preflight, 'Access-Control-Allow-Headers').includes(name), name)
  assert.equal(preflight.headers.get('Access-Control-Max-Age'), '7200')
  const picture = await fetch(client.url(scene), { headers: { Origin: 'https://elsewhere.example' } })
  for (const name of ['etag', 'relit-accuracy', 'server-timing', 'retry-after'])
    assert.ok(list(picture, 'Access-Control-Expose-Headers').includes(name), name)
})
