// Images that come in: by the file picker, dropped, or pasted; each for the height map, the mask, the colour or the surroundings.
import { upload } from '../relit-jobs.js'
import { likelyRole, sceneWith } from './shelf.js'

const roleNames = { height: 'height map', alpha: 'mask', albedo: 'colour', bump: 'bump map', environment: 'surroundings' }

/** @param catalogue  {reliefs, environments}: what was opened is added to them */
export function bindOpen(store, client, catalogue, say, fail) {
  const picker = document.getElementById('file')
  const drop = document.getElementById('drop')
  const progress = document.getElementById('upload')
  let role = 'height'
  let turn = 0

  async function open(file, as) {
    const mine = ++turn
    say(`${file.name || 'The image'} is being sent …`, 'wait')
    progress.hidden = false
    progress.value = 0
    try {
      const told = { progress: (sent, total) => (progress.value = sent / total) }
      const image = await client.withKey(() => upload(client, file, told))
      if (mine === turn) use(image, file.name || 'Pasted image', as)
    } catch (error) {
      if (mine === turn) fail(error)
    } finally {
      if (mine === turn) progress.hidden = true
    }
  }

  function use(image, title, as) {
    const list = as === 'environment' ? catalogue.environments : as === 'height' ? catalogue.reliefs : []
    if (!list.some(({ id }) => id === image.id)) list.push({ ...image, title })
    if (as === 'height') store.know({ ...image, title })
    store.change(sceneWith(store.scene, as, image.id, store.ui.active))
    say(`${title} is the ${roleNames[as]}.`)
  }

  const pick = (as) => {
    role = as
    picker.click()
  }
  for (const button of document.querySelectorAll('[data-open]'))
    button.addEventListener('click', () => pick(button.dataset.open))
  picker.addEventListener('change', () => {
    if (picker.files[0]) open(picker.files[0], role)
    picker.value = ''
  })
  for (const button of document.querySelectorAll('[data-clear]'))
    button.addEventListener('click', () => store.change({ ...store.scene, [button.dataset.clear]: null }))

  // A drag over the window shows where a file may go; beside the four places it goes where it most likely belongs.
  let depth = 0
  const dropping = (on) => {
    depth = on ? depth : 0
    drop.hidden = !on
  }
  const hasFile = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files')
  addEventListener('dragenter', (event) => {
    if (!hasFile(event)) return
    ++depth
    dropping(true)
  })
  addEventListener('dragover', (event) => {
    if (!hasFile(event)) return
    event.preventDefault()
    for (const zone of drop.children) zone.classList.toggle('target', zone.contains(event.target))
  })
  addEventListener('dragleave', () => --depth <= 0 && dropping(false))
  addEventListener('drop', (event) => {
    event.preventDefault()
    dropping(false)
    const [file] = event.dataTransfer.files
    const zone = event.target.closest?.('[data-role]')
    if (file && store.scene) open(file, zone?.dataset.role ?? likelyRole(file))
  })
  addEventListener('paste', (event) => {
    if (event.target.closest?.('input, textarea')) return
    const [file] = event.clipboardData?.files ?? []
    if (file && store.scene) open(file, likelyRole(file))
  })

  return {
    open,
    show() {
      if (!store.scene) return
      for (const name of ['alpha', 'albedo', 'bump']) {
        const id = store.scene[name]?.image
        document.querySelector(`[data-clear="${name}"]`).hidden = !id
        document.getElementById(`${name}-state`).textContent = id
          ? 'set'
          : name === 'alpha'
            ? 'of the map, if any'
            : 'none'
      }
    },
  }
}
