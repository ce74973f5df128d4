// The picture in words to paste elsewhere. Each of them makes the same picture as the download; the tests run them.

const shellQuoted = (text) => `'${text.replaceAll("'", String.raw`'\''`)}'`
const attribute = (text) => text.replaceAll('&', '&amp;').replaceAll('"', '&quot;').replaceAll('<', '&lt;')
const endings = { png: 'png', jpeg: 'jpg', webp: 'webp', exr: 'exr' }

/** Name of the picture's file. */
export const fileName = (name, format) => {
  const stem =
    name
      .replace(/\.\w{2,4}$/, '')
      .replace(/[^\p{L}\p{N}_-]+/gu, '-')
      .replace(/^-+|-+$/g, '') || 'relief'
  return `${stem}-relit.${endings[format]}`
}

/**
 * @param scene    short, with `output` as the picture is to be
 * @param picture  {server, name: what the picture shows, file: name of the relief, format, images: ids of all images,
 *                  samples: ids of images that ship, url: the picture's address, link: of this page, element: the scene as
 *                  <relit-image> takes it, size: [width, height] of the picture, keyed: whether the server asks for a key}
 * @return         [{name, title, text, note}]
 */
export function snippetsOf(scene, picture) {
  const { server, format, url, link, keyed } = picture
  const key = keyed ? ' -H "Authorization: Bearer $RELIT_API_KEY"' : ''
  const sentence = (open, asking) => (keyed ? asking : open)
  const file = fileName(picture.file, format)
  const text = JSON.stringify(scene)
  return [
    { name: 'link', title: 'Link', text: link, note: 'Opens the studio with this scene.' },
    {
      name: 'scene',
      title: 'Scene',
      text: JSON.stringify(scene, null, 2),
      note: 'For POST /v1/render, batches and relit render --scene.',
    },
    {
      name: 'curl',
      title: 'curl',
      text: `curl ${shellQuoted(server + '/v1/render')} -o ${shellQuoted(file)}${key} --json ${shellQuoted(text)}`,
      note: sentence('Writes the picture, as the download has it.', 'The key is taken from RELIT_API_KEY.'),
    },
    {
      name: 'img',
      title: '<img>',
      text: imageTag(url, picture),
      note: sentence('The picture has an address, and caches keep it.', 'Sign the address with relit sign-url: it has no key.'),
    },
    {
      name: 'element',
      title: '<relit-image>',
      text: elementTag(picture),
      note: sentence(
        'A picture whose light visitors can move.',
        'A picture whose light visitors can move, with a key="…" that they can read: of scope render, for this page.',
      ),
    },
    {
      name: 'cli',
      title: 'relit',
      text: command(scene, file, picture),
      note: sentence(
        'The command line. It makes the same bytes without a server, where it has the files.',
        'The command line. Where it asks the server, the key is taken from RELIT_API_KEY.',
      ),
    },
  ]
}

function imageTag(url, { name, size }) {
  const [width, height] = size
  return `<img src="${attribute(url)}" width="${width}" height="${height}" alt="${attribute(name)}">`
}

function elementTag({ server, name, element }) {
  const { height, ...scene } = element
  const rest = Object.keys(scene).length
    ? `\n  scene='${JSON.stringify(scene).replaceAll('&', '&amp;').replaceAll("'", '&#39;')}'`
    : ''
  return (
    `<script type="module" src="${attribute(server)}/relit.js"></script>\n` +
    `<relit-image src="${height.image}"${rest}\n  alt="${attribute(name)}"></relit-image>`
  )
}

function command(scene, file, { server, samples, images }) {
  const far = images.every((id) => samples.includes(id)) ? '' : ` --server ${shellQuoted(server)}`
  return `relit render --scene - -o ${shellQuoted(file)}${far} <<'END'\n${JSON.stringify(scene, null, 2)}\nEND`
}
