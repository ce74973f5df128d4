// What leaves the studio and what it teaches, in a real browser against a real server: links and words that make the same
// picture again, files, the cross-section; and who can use it: contrast, names, keys. Names are claims.
import assert from 'node:assert/strict'
import { execFileSync } from 'node:child_process'
import { mkdtemp, readFile, rm } from 'node:fs/promises'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { after, test } from 'node:test'
import { fileURLToPath } from 'node:url'
import { layerNames, lightControls, mediumControls, sceneControls } from '../../clients/studio/controls.js'
import { readFields, readMediumFields } from '../../clients/studio/fields.js'
import { decodePng } from '../../clients/studio/png.js'
import { close, drag, finalFrame, keep, openStudio, rested, sceneNow, staged, violations, withoutTrouble } from './support.js'

const stage = await staged()
const { server } = stage
const folder = await mkdtemp(join(tmpdir(), 'relit-share-'))
after(() => rm(folder, { recursive: true }))

const repository = fileURLToPath(new URL('../..', import.meta.url))
const open = (path, options) => openStudio(stage, path, options)
const post = (path, scene) =>
  fetch(server.address + path, {
    method: 'POST',
    body: JSON.stringify(scene),
    headers: { 'Content-Type': 'application/json' },
  })
const etagOf = async (scene) => (await post('/v1/scene', scene)).headers.get('ETag')
const bytesOf = async (scene) => Buffer.from(await (await post('/v1/render', scene)).arrayBuffer())

// A scene of its own: an uploaded map, several lights, an odd name.
async function prepared() {
  const page = await open()
  const buffer = await readFile(join(repository, 'server/samples/pictures/plaster.jpg'))
  await page.setInputFiles('#file', { name: "Anna's & Otto's.jpg", mimeType: 'image/jpeg', buffer })
  await page.waitForFunction(() => document.getElementById('title').textContent.startsWith('Anna'))
  await page.click('#looks [data-name="wax"]')
  await page.waitForSelector('#looks [data-name="wax"][aria-pressed="true"]')
  await drag(page, [0.5, 0.5], [0.7, 0.3])
  await rested(page)
  return page
}

async function copiedAs(page, title) {
  if (!(await page.isVisible('#share'))) await page.click('#copy-as')
  await page.locator('#snippet-kinds').getByText(title, { exact: true }).click()
  return page.inputValue('#snippet')
}

test('a link shows the same again, byte for byte, and a broken one says so', async () => {
  const page = await prepared()
  const { etag } = await finalFrame(page)
  assert.match(etag, /^"/)
  const link = await copiedAs(page, 'Link')
  const other = await open(link.slice(server.address.length))
  assert.equal((await finalFrame(other)).etag, etag)
  withoutTrouble(page)
  withoutTrouble(other)
  await close(page)
  await close(other)
  const broken = await open('/#scene=bm8')
  assert.match(await broken.textContent('#message'), /^The link holds no scene/)
  await close(broken)
  const gone = Buffer.from(JSON.stringify({ height: { image: 'f'.repeat(64) } })).toString('base64url')
  const stale = await open(`/#scene=${gone}`)
  assert.match(await stale.textContent('#message'), /open the file again/)
  assert.equal(
    await stale.textContent('#title'),
    (await (await fetch(server.address + '/v1/samples')).json()).samples[0].title,
  )
  await close(stale)
})

test('every "copy as" makes the same picture: scene, curl, <img>, <relit-image>, relit', async () => {
  const page = await prepared()
  const scene = await sceneNow(page, server.address)
  const etag = await etagOf(scene)
  const bytes = await bytesOf(scene)

  assert.equal(await etagOf(JSON.parse(await copiedAs(page, 'Scene'))), etag)

  const curl = await copiedAs(page, 'curl')
  execFileSync('sh', ['-c', curl], { cwd: folder, stdio: 'ignore' })
  const file = curl.match(/-o '([^']+)'/)[1]
  assert.equal(file, 'Anna-s-Otto-s-relit.png')
  assert.ok(bytes.equals(await readFile(join(folder, file))), 'curl')
  await rm(join(folder, file))

  const relit = await copiedAs(page, 'relit')
  assert.match(relit, /--server/, "the file is the server's")
  execFileSync('sh', ['-c', relit.replace(/^relit /, `'${process.env.RELIT}' `)], { cwd: folder })
  assert.ok(bytes.equals(await readFile(join(folder, file))), 'relit')

  const tag = await copiedAs(page, '<img>')
  await page.evaluate(
    (tag) => document.body.insertAdjacentHTML('beforeend', tag.replace('<img', '<img id="pasted"')),
    tag,
  )
  const size = await page
    .locator('#pasted')
    .evaluate((img) => img.decode().then(() => [img.naturalWidth, img.width, img.alt, img.src]))
  assert.deepEqual(size.slice(0, 3), [270, 270, "Anna's & Otto's.jpg"])
  const picture = await fetch(size[3])
  assert.equal(picture.headers.get('ETag'), etag)
  assert.ok(bytes.equals(Buffer.from(await picture.arrayBuffer())), '<img>')

  const shown = await finalFrame(page)
  const element = await copiedAs(page, '<relit-image>')
  assert.match(element, /^<script type="module" src="http[^"]+\/relit.js">/)
  const width = await page.locator('#picture').evaluate((picture) => picture.clientWidth)
  const blank = await page.context().newPage()
  await blank.addInitScript(() =>
    addEventListener('relit-frame', ({ detail }) => detail.final && (globalThis.etag = detail.etag)),
  )
  await blank.route('**/blank', (route) =>
    route.fulfill({
      contentType: 'text/html',
      body: `<!doctype html><body><div style="width:${width}px">${element}</div>`,
    }),
  )
  await blank.goto(server.address + '/blank')
  await blank.waitForFunction(() => globalThis.etag)
  assert.equal(await blank.evaluate(() => globalThis.etag), shown.etag, '<relit-image>')
  withoutTrouble(page)
  await keep(page, 'copy-as')
  await close(page)
})

test('of a sample the command needs no server', async () => {
  const page = await open()
  const relit = await copiedAs(page, 'relit')
  assert.ok(!relit.includes('--server'))
  execFileSync('sh', ['-c', relit.replace(/^relit /, `'${process.env.RELIT}' `)], { cwd: folder })
  const bytes = await bytesOf(await sceneNow(page, server.address))
  assert.ok(bytes.equals(await readFile(join(folder, 'plato-relit.png'))))
  await close(page)
})

test('the download is the file that Export says: all of the map or what is shown, EXR, 16 bits', async () => {
  const page = await open()
  const saved = async () => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#download')])
    return [download.suggestedFilename(), await readFile(await download.path())]
  }
  const expect = async (name) => {
    const [file, bytes] = await saved()
    assert.equal(file, name)
    assert.ok(bytes.equals(await bytesOf(await sceneNow(page, server.address))), name)
    return bytes
  }
  const group = (label) => page.getByRole('radiogroup', { name: label, exact: true })
  assert.equal((await decodePng((await expect('plato-relit.png')).buffer)).width, 512)
  await group('Bits').getByText('Set').click()
  assert.equal((await expect('plato-relit.png'))[24], 16)
  await group('Bits').getByText('Usual').click()
  await group('Format').getByText('EXR').click()
  assert.equal((await expect('plato-relit.exr')).readUInt32LE(0), 20000630)
  await group('Format').getByText('JPEG').click()
  await group('Width').getByText('Set').click()
  await expect('plato-relit.jpg')
  await page.getByRole('button', { name: 'Zoom in' }).click({ clickCount: 4 })
  await group('Part').getByText('What is shown').click()
  assert.ok((await sceneNow(page, server.address)).output.region[2] < 512)
  await expect('plato-relit.jpg')
  withoutTrouble(page)
  await close(page)
})

test("the cross-section's r is the server's own, for points, suns and light from behind", async () => {
  const page = await open()
  await page.keyboard.press('x')
  const figure = async () => Number((await page.textContent('#cut')).match(/r = ([\d.]+)/)[1])
  const probe = async () => (await page.getAttribute('#probe', 'aria-valuetext')).match(/\d+/g).map(Number)
  const agree = async (what) => {
    await page.waitForFunction(() => /r = [\d.∞]+/.test(document.getElementById('cut').textContent))
    const scene = await sceneNow(page, server.address)
    const [i, j] = await probe()
    const png = await bytesOf({
      ...scene,
      lights: [scene.lights[0]],
      output: { layer: 'thickness', bitDepth: 16, region: [i, j, 1, 1] },
    })
    const thickness = (await decodePng(png.buffer.slice(png.byteOffset, png.byteOffset + png.length))).numbers[0]
    const r = await figure()
    assert.ok(
      Math.abs(r - thickness) < 2e-4 + 0.01 * thickness,
      `${what}: r is ${r} on the page, ${thickness} by the server`,
    )
    return r
  }
  await agree('a point')
  const before = await probe()
  await page.locator('#probe').focus()
  for (let i = 0; i < 4; ++i) await page.keyboard.press('Shift+ArrowDown')
  assert.deepEqual(await probe(), [before[0], before[1] + 80])
  await agree('further down')
  await drag(page, [0.5, 0.5], [0.98, 0.5])
  await page.getByRole('radiogroup', { name: 'Kind of light' }).getByText('Sun').click()
  await agree('a sun')
  const elevation = page.getByLabel('Elevation').locator('visible=true').last()
  await elevation.fill('8')
  await elevation.press('Enter')
  await agree('a low sun')
  await page.click('#looks [data-name="wax"]')
  await page.waitForSelector('#looks [data-name="wax"][aria-pressed="true"]')
  assert.ok((await agree('light from behind')) > 0.05)
  assert.match(await page.getAttribute('#plot', 'aria-label'), /^Cross-section under the light's ray: r = /)
  assert.ok((await page.locator('#plot .inside').getAttribute('d')).length > 10)
  withoutTrouble(page)
  await keep(page, 'section')
  await close(page)
})

test('every field of a scene has a control, within what the server takes', async () => {
  const api = await (await fetch(server.address + '/openapi.json')).json()
  const fields = readFields(api)
  const lights = Object.entries(lightControls).flatMap(([type, controls]) =>
    controls.map((control) => ({ ...control, field: `${type}.${control.path.replace(/\.\d$/, '')}` })),
  )
  const all = [
    ...lights,
    ...Object.values(sceneControls)
      .flat()
      .map((control) => ({ ...control, field: control.path })),
  ]
  const elsewhere = [
    'preset',
    'height',
    'alpha',
    'albedo',
    'bump',
    'light',
    'lights',
    'output.layer',
    'output.region',
    'point.type',
    'directional.type',
    'directional.direction',
    'environment.type',
    'environment.image',
    'output.accuracy',
  ] // the picture's own matter: quick while something moves, final at rest and in files
  assert.deepEqual(
    [...fields.keys()].filter((path) => !all.some(({ field }) => field === path)),
    elsewhere
      .filter((path) => fields.has(path))
      .sort((a, b) => [...fields.keys()].indexOf(a) - [...fields.keys()].indexOf(b)),
  )
  for (const { field, kind, low, high, tip, names } of all) {
    const known = fields.get(field)
    assert.ok(known, field)
    assert.ok(known.sentence && tip, `${field} says what it does`)
    if (['number', 'falloff', 'size'].includes(kind))
      assert.ok(low >= known.low && high <= known.high && low < high, field)
    if (['choice', 'pick'].includes(kind))
      assert.deepEqual(Object.keys(names).sort(), [...known.choices].sort(), field)
  }
  assert.deepEqual(Object.keys(mediumControls), [...readMediumFields(api).keys()], 'a medium by its numbers')
  assert.deepEqual(Object.keys(layerNames).sort(), [...fields.get('output.layer').choices].sort())
})

test('axe finds no serious violation: light, dark, phone, dialog, with all that can be opened', async () => {
  for (const [name, options] of Object.entries({
    light: { colorScheme: 'light' },
    dark: { colorScheme: 'dark' },
    phone: { colorScheme: 'light', viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
  })) {
    const page = await open('/', { viewport: { width: 1440, height: 900 }, ...options })
    await keep(page, name)
    assert.deepEqual(await violations(page), [], `${name}, first`)
    await page.click('#looks [data-name="jade"]')
    if (name === 'phone')
      for (const tab of await page.locator('#tabs button').all()) {
        await tab.tap()
        assert.deepEqual(await violations(page), [], `${name}, ${await tab.textContent()}`)
      }
    await page.click('#compare')
    await page.click('#cut-toggle')
    await page.waitForFunction(() => document.getElementById('cut').textContent)
    await rested(page)
    assert.deepEqual(await violations(page), [], name)
    await keep(page, `all-${name}`)
    await page.click('#share-open')
    assert.deepEqual(await violations(page), [], `${name}, dialog`)
    await close(page)
  }
})

test('with keys alone: from the light to a look, a slider, the dialog, and back', async () => {
  const page = await open()
  const focused = () => page.evaluate(() => document.activeElement.id || document.activeElement.textContent.trim())
  await page.locator('#picture [part~="handle"]').focus()
  const before = (await sceneNow(page, server.address)).lights[0].position
  await page.keyboard.press('ArrowRight')
  await page.keyboard.press('PageUp')
  const [x, , z] = (await sceneNow(page, server.address)).lights[0].position
  assert.ok(Math.abs(x - before[0] - 0.02) < 1e-6 && Math.abs(z - before[2] - 0.02) < 1e-6, `${before} then ${x}, ${z}`)
  await page.locator('#looks .card').first().focus()
  await page.keyboard.press('Tab')
  await page.keyboard.press('Enter')
  await page.waitForSelector('#looks [data-name="marble"][aria-pressed="true"]')
  await page.locator('#share-open').focus()
  await page.keyboard.press('Enter')
  assert.ok(await page.isVisible('#share'))
  await page.keyboard.press('Escape')
  assert.equal(await focused(), 'share-open')
  await page.locator('#theme').press('Enter')
  assert.equal(await page.getAttribute('html', 'data-theme'), 'light')
  await page.reload()
  assert.equal(await page.getAttribute('html', 'data-theme'), 'light', 'it is kept')
  await finalFrame(page)
  const steps = new Set()
  for (let i = 0; i < 180; ++i) {
    await page.keyboard.press('Tab')
    steps.add(await focused())
  }
  for (const id of [
    'open',
    'share-open',
    'picture',
    'compare',
    'cut-toggle',
    'layer',
    'add-light',
    'pad-dot',
    'download',
    'copy-as',
  ])
    assert.ok(steps.has(id), `the tab key comes to ${id}`)
  withoutTrouble(page)
  await close(page)
})
