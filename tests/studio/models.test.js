// Models of subsurface scattering in the studio, in a real browser against a real server: models, media, optical size, films,
// highlights, layers, and the section that explains the models. Names are claims.
import assert from 'node:assert/strict'
import { test } from 'node:test'
import { models } from '../../clients/studio/models.js'
import { reachOf } from '../../clients/studio/media.js'
import { decodePng } from '../../clients/studio/png.js'
import {
  close,
  countFetches,
  drag,
  finalFrame,
  halves,
  keep,
  message,
  openStudio,
  rested,
  sceneNow,
  staged,
  violations,
  withoutTrouble,
} from './support.js'

const stage = await staged()
const { server } = stage
const open = (path, options) => openStudio(stage, path, options)
const scene = (page) => sceneNow(page, server.address)
const material = async (page) => (await scene(page)).material
const get = async (path) => (await fetch(server.address + path)).json()

const row = (page, label) => page.locator('#material .row:visible', { has: page.getByText(label, { exact: true }) })
const pick = (page, label, value) => row(page, label).locator('select').selectOption(value)
const segment = (page, label, text) =>
  page.getByRole('radiogroup', { name: label, exact: true }).getByText(text, { exact: true }).click()
const type = async (field, value) => {
  await field.fill(String(value))
  await field.press('Enter')
}
const labels = (page) => page.locator('#material .row:visible .name').allTextContents()

/** The studio with a model, and its picture. */
async function withModel(model, options) {
  const page = await open('/', options)
  page.setDefaultTimeout(20_000)
  await pick(page, 'Model', model)
  await finalOf(page, (frame) => frame.scene.material.model === model)
  return page
}

/** The newest final picture, once it is of such a scene. */
async function finalOf(page, isIt) {
  for (;;) {
    const frame = await finalFrame(page)
    if (isIt(frame)) return frame
    await page.waitForTimeout(50)
  }
}

test('a model and a medium change the picture and the scene, and the rows are those that count', async () => {
  const page = await open()
  page.setDefaultTimeout(20_000)
  await segment(page, 'Fades by', 'Count')
  assert.ok((await labels(page)).includes('Steps'))
  const counted = await finalOf(page, ({ scene }) => scene.material.illumination === 'count')
  await pick(page, 'Model', 'dipole')
  const marble = await finalOf(page, ({ scene }) => scene.material.model === 'dipole')
  assert.notEqual(marble.etag, counted.etag)
  assert.equal((await material(page)).illumination, 'length', 'the server counts no samples below a surface')
  assert.ok(await page.getByLabel('Count', { exact: true }).isDisabled())
  const shown = await labels(page)
  assert.deepEqual(
    ['Medium', 'Optical size', 'Gloss k', 'Depth t', 'Steps', 'Offset', 'Film of'].filter((name) => shown.includes(name)),
    ['Medium', 'Optical size', 'Gloss k', 'Depth t'],
  )
  const white = await halves(page)
  await pick(page, 'Medium', 'ketchup')
  await finalOf(page, ({ scene }) => scene.material.medium === 'ketchup')
  const red = await halves(page)
  assert.ok(red[0] < white[0] - 10, `ketchup is darker than marble: ${red} and ${white}`)
  assert.equal((await material(page)).medium, 'ketchup')
  await pick(page, 'Model', 'integrated')
  assert.ok(!(await labels(page)).includes('Medium'))
  assert.equal(await message(page), '')
  withoutTrouble(page)
  await close(page)
})

test('every medium is listed by its title, and its numbers can be others', async () => {
  const { media } = await get('/v1/media')
  const page = await withModel('dipole')
  const list = row(page, 'Medium').locator('select')
  const options = await list.locator('optgroup option').evaluateAll((all) => all.map(({ value, text }) => [value, text]))
  assert.deepEqual(options.sort(), media.map(({ name, title }) => [name, title]).sort())
  assert.equal(await list.inputValue(), 'marble')
  await pick(page, 'Medium', 'By its numbers') // opens them and changes nothing
  assert.equal(await list.inputValue(), 'marble')
  const field = page.getByRole('group', { name: 'Absorbs' }).getByLabel('Absorbs green')
  assert.equal(await field.inputValue(), '0.0041')
  await type(field, 0.5)
  await type(page.getByLabel('Scatters blue').first(), -3) // the least is above 0
  await type(page.getByLabel('Index').first(), 1.4)
  const own = { sigmaA: [0.0021, 0.5, 0.0071], sigmaS: [2.19, 2.62, 1e-6], g: [0, 0, 0], eta: 1.4 }
  assert.deepEqual((await material(page)).medium, own)
  assert.equal(await list.inputValue(), 'own')
  await rested(page)
  const link = page.url()
  const other = await open(link.slice(server.address.length))
  assert.deepEqual((await material(other)).medium, own, 'a link keeps them')
  await close(other)
  await pick(page, 'Medium', 'marble')
  assert.equal((await material(page)).medium, 'marble')
  assert.equal(await field.inputValue(), '0.0041')
  withoutTrouble(page)
  await close(page)
})

test("the optical size says how far light reaches, as the server's media do, and a small thing is smoother", async () => {
  const { media } = await get('/v1/media')
  for (const { name, medium, reach } of media)
    reachOf(medium).forEach((mm, c) => assert.ok(Math.abs(mm / reach[c] - 1) < 1e-6, `${name}: ${mm}, ${reach[c]}`))
  const page = await withModel('dipole')
  const reaches = () => page.getAttribute('.reach', 'aria-label')
  const of = media.find(({ name }) => name === 'marble').reach
  assert.match(await reaches(), new RegExp(`red ${Number(((100 * of[0]) / 80).toPrecision(2))} %, green`))
  const slider = row(page, 'Optical size').locator('input[type=range]')
  await slider.focus()
  await page.keyboard.press('ArrowRight')
  assert.ok((await material(page)).mmPerWidth > 80)
  const figure = row(page, 'Optical size').locator('input.figure')
  const detail = async (mm) => {
    await type(figure, mm)
    await finalOf(page, ({ scene }) => scene.material.mmPerWidth === mm)
    return detailOf(page)
  }
  const large = await detail(3000)
  const small = await detail(15)
  assert.ok(small < 0.7 * large, `relief that is left: ${small} of the small thing, ${large} of the large one`)
  await type(figure, 2)
  assert.match(await reaches(), /red all, green all, blue all/)
  await rested(page)
  withoutTrouble(page)
  await close(page)
})

/** How much the middle of the picture differs from texel to texel, beside its brightness. */
const detailOf = (page) =>
  page.evaluate(() => {
    const picture = document.getElementById('picture').shadowRoot.querySelector('canvas')
    const copy = Object.assign(document.createElement('canvas'), { width: 128, height: 128 })
    const context = copy.getContext('2d')
    context.drawImage(picture, 0, 0, 128, 128)
    const { data } = context.getImageData(48, 30, 32, 32)
    let [steps, sum] = [0, 0]
    for (let at = 0; at < data.length - 4; at += 4) {
      sum += data[at]
      if ((at / 4) % 32 !== 31) steps += Math.abs(data[at + 4] - data[at])
    }
    return steps / sum
  })

test('a film comes with its medium and thickness and goes, lobes of highlights are ones that the server takes', async () => {
  const page = await withModel('dipole', { colorScheme: 'dark' })
  const film = page.getByText('Film on the surface')
  await film.click()
  await page.locator('.numbers:visible summary').first().click()
  assert.deepEqual(await violations(page), [])
  assert.deepEqual((await material(page)).film, { medium: 'epidermis', thickness: 0.01, g: null })
  await type(row(page, 'Thickness').locator('input.figure'), 0.05)
  await pick(page, 'Film of', 'dermis')
  await segment(page, 'Film g', 'Set')
  assert.deepEqual((await material(page)).film, { medium: 'dermis', thickness: 0.05, g: 0.5 })
  await film.click()
  assert.equal((await material(page)).film, null)
  assert.ok(!(await labels(page)).includes('Thickness'))
  assert.ok(await row(page, 'Lobe').locator('select').isDisabled(), 'of highlights that are not there')
  await type(row(page, 'Gloss k').locator('input.figure'), 0.4)
  await segment(page, 'Gloss leaves', 'Where it enters')
  const rows = { cosine: ['Exponent'], ashikhmin: ['Sharp, up', 'Sharp, across'] }
  rows.lafortune = ['Lean, up', 'Lean, across', 'Exponent']
  for (const lobe of ['cosine', 'lafortune', 'ashikhmin']) {
    await pick(page, 'Lobe', lobe)
    await finalOf(page, ({ scene }) => scene.material.highlight.lobe === lobe)
    const shown = await labels(page)
    assert.deepEqual(shown.filter((name) => /^(Sharp|Lean|Exponent)/.test(name)), rows[lobe])
    assert.equal(await message(page), '', lobe)
  }
  const { lobe, transport, k, nt } = (await material(page)).highlight
  assert.deepEqual([lobe, transport, k, nt], ['ashikhmin', 'local', 0.4, 10])
  withoutTrouble(page)
  await close(page)
})

test('layers are offered where there are any, and one that goes gives way to the picture', async () => {
  const page = await open()
  page.setDefaultTimeout(20_000)
  const offered = () => page.locator('#layer option:enabled').evaluateAll((all) => all.map(({ value }) => value))
  const below = ['subsurface', 'highlight']
  const has = async (layers) => (await offered()).filter((layer) => layers.includes(layer))
  assert.deepEqual(await has(['irradiance', ...below]), ['irradiance'])
  await pick(page, 'Model', 'normalised-diffusion')
  assert.deepEqual(await has(below), below)
  for (const layer of ['irradiance', 'subsurface', 'highlight']) {
    await page.selectOption('#layer', layer)
    await finalOf(page, ({ scene }) => scene.output.layer === layer)
    assert.equal(await message(page), '', layer)
  }
  await pick(page, 'Model', 'integrated')
  await finalOf(page, ({ scene }) => scene.output.layer === 'beauty')
  assert.equal(await page.inputValue('#layer'), 'beauty')
  await segment(page, 'Kind of light', 'Sun')
  await page.selectOption('#layer', 'thickness')
  await segment(page, 'Kind of light', 'Surroundings')
  assert.deepEqual(await has(['thickness']), [])
  await rested(page)
  assert.equal(await message(page), '')
  withoutTrouble(page)
  await close(page)
})

test('while the light is dragged one picture at a time is asked for, and the final one comes when the hand rests', async () => {
  const page = await withModel('dipole')
  await page.evaluate(countFetches, '/v1/render')
  await drag(page, [0.2, 0.3], [0.8, 0.6])
  const slider = row(page, 'Optical size').locator('input[type=range]')
  await slider.focus()
  for (let i = 0; i < 12; ++i) await page.keyboard.press('ArrowRight')
  const { lights, material } = await scene(page)
  const last = await finalOf(page, (frame) => frame.scene.material.mmPerWidth === material.mmPerWidth)
  assert.deepEqual(last.scene.lights, lights)
  const { most, bodies } = await page.evaluate(() => asked)
  assert.equal(most, 1)
  const accuracies = bodies.map((body) => JSON.parse(body).output.accuracy)
  assert.ok(accuracies.includes('preview'))
  assert.equal(accuracies.at(-1), 'final')
  withoutTrouble(page)
  await close(page)
})

test("the cross-section's V and cos are the server's irradiance, and it shows no d", async () => {
  const page = await withModel('better-dipole')
  await page.keyboard.press('x')
  await page.locator('#probe').focus()
  for (const key of ['', 'Right', 'Right', 'Down', 'Down', 'Left']) {
    if (key) await page.keyboard.press(`Shift+Arrow${key}`)
    await page.waitForFunction(() => /V = .* cos = /.test(document.getElementById('cut').textContent))
    const words = await page.textContent('#cut')
    const [v, cosine] = words.match(/[\d.]+(?= {3}cos|$)/g).map(Number)
    const texel = (await page.getAttribute('#probe', 'aria-valuetext')).match(/\d+/g).map(Number)
    const whole = await scene(page)
    const reply = await fetch(server.address + '/v1/render', {
      method: 'POST',
      headers: { 'Content-Type': 'application/json' },
      body: JSON.stringify({
        ...whole,
        lights: [{ ...whole.lights[0], color: '#ffffff', intensity: 1 }],
        output: { layer: 'irradiance', bitDepth: 16, region: [...texel, 1, 1] },
      }),
    })
    const [irradiance] = (await decodePng(await reply.arrayBuffer())).numbers
    assert.ok(Math.abs(v * cosine - irradiance) < 0.012, `at ${texel}: ${words}; the server has ${irradiance}`)
    assert.ok(!words.includes('d ='))
  }
  assert.match(await page.textContent('#cut-means'), /the model’s/)
  await pickIntegrated(page)
  withoutTrouble(page)
  await close(page)
})

async function pickIntegrated(page) {
  await pick(page, 'Model', 'integrated')
  await page.waitForFunction(() => / d = /.test(document.getElementById('cut').textContent))
}

test('looks below the surface stand apart, each asked for once, as previews', async () => {
  const page = await open('/')
  const asked = []
  page.on('request', (request) => request.url().includes('/v1/render?scene=') && asked.push(request.url()))
  const { presets } = await get('/v1/presets')
  const below = presets.filter(({ scene }) => scene.material?.model).map(({ name }) => name)
  assert.ok(below.length >= 10)
  const cards = page.locator('#looks-below .card')
  assert.deepEqual(await cards.evaluateAll((all) => all.map(({ dataset }) => dataset.name)), below)
  await page.click('#reliefs .card:nth-child(3)')
  await page.waitForFunction(() => document.querySelectorAll('#looks img:not(.there)').length === 0, null, {
    timeout: 60_000,
  })
  const scenes = asked.map((url) => JSON.parse(Buffer.from(url.split('scene=')[1], 'base64url')))
  const fish = scenes.filter(({ preset, height }) => below.includes(preset) && height.image === (scenes.at(-1).height.image))
  assert.deepEqual(fish.map(({ preset }) => preset).sort(), [...below].sort())
  assert.ok(fish.every(({ output }) => output.accuracy === 'preview'))
  await keep(page, 'looks')
  withoutTrouble(page)
  await close(page)
})

test("'What each model does' asks for its pictures when it is opened, and a picture takes its model along", async () => {
  const page = await open('/', { viewport: { width: 1440, height: 900 } })
  page.setDefaultTimeout(30_000)
  assert.equal(await page.locator('#models img').count(), 0)
  await page.locator('#models-open').focus()
  await page.keyboard.press('Enter')
  const pictures = page.locator('#models .card')
  assert.equal(await pictures.count(), models.length * 12)
  await page.waitForFunction(() => document.querySelectorAll('#models img:not(.there)').length === 0, null, {
    timeout: 60_000,
  })
  for (const { title, does } of models) {
    const section = page.getByRole('region', { name: title, exact: false }).first()
    assert.ok((await section.textContent()).includes(does), title)
  }
  assert.match(await page.textContent('#models-caution'), /10 to 30 %/)
  assert.match(await page.textContent('.model .on'), /in this scene/)
  assert.deepEqual(await violations(page), [])
  await keep(page, 'models')
  await page.keyboard.press('Escape')
  assert.equal(await page.evaluate(() => document.activeElement.id), 'models-open')
  assert.equal(await page.locator('#models img').count(), 0, 'nothing of it is left to be asked for')

  const before = await scene(page)
  await page.keyboard.press('Enter')
  await page.keyboard.press('Tab') // from Close to the first picture
  assert.match(await page.evaluate(() => document.activeElement.ariaLabel), /^Integrated, without highlights, sun at 5°$/)
  await page.getByRole('button', { name: 'Dipole, with highlights, sun at 15°', exact: true }).press('Enter')
  assert.ok(!(await page.isVisible('#models')))
  const after = await scene(page)
  assert.deepEqual([after.material.model, after.material.highlight.k], ['dipole', 0.2])
  assert.deepEqual(after.lights, before.lights, 'the lights stay')
  await finalOf(page, (frame) => frame.scene.material.model === 'dipole')
  await page.keyboard.press('Control+z')
  assert.deepEqual(await scene(page), before, 'it is one step of undo')
  await rested(page)
  withoutTrouble(page)
  await close(page)
})

test('on a phone the models and their rows fit, and the section opens under the finger', async () => {
  const page = await withModelOnPhone()
  const width = () => page.evaluate(() => document.documentElement.scrollWidth)
  assert.equal(await width(), 390)
  await page.locator('.numbers:visible summary').first().tap()
  assert.equal(await width(), 390)
  await keep(page, 'phone-material')
  await page.locator('#models-open').tap()
  await page.waitForFunction(() => document.querySelectorAll('#models img.there').length >= 6)
  assert.equal(await width(), 390)
  const box = await page.locator('#models').boundingBox()
  assert.ok(box.x >= 0 && box.x + box.width <= 390)
  assert.equal(await page.locator('#models').evaluate((dialog) => dialog.scrollWidth > dialog.clientWidth), false)
  assert.deepEqual(await violations(page), [])
  await keep(page, 'phone-models')
  await page.locator('#models-close').tap()
  assert.ok(!(await page.isVisible('#models')))
  withoutTrouble(page)
  await close(page)
})

async function withModelOnPhone() {
  const page = await open('/', { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true })
  page.setDefaultTimeout(20_000)
  await page.locator('#tabs [data-tab="material"]').tap()
  await pick(page, 'Model', 'dipole')
  await page.getByText('Film on the surface').tap()
  await rested(page)
  return page
}
