// The controls of the studio, a row each: which field of the scene, how it is called, how far its slider goes. Ranges, words
// and what a field means come from the server (fields.js); `tip` says what it does to the picture. Fields of lights are those
// of the light in hand. A slider spans what is commonly wanted; the number beside it takes all that the server takes.
//
// kind   number      a slider and a number
//        falloff     two thumbs and two numbers
//        colour      a colour picker
//        choice      one of the field's words; `names` of them for people
//        check       yes or no
// words  values beside the control's own, as [value, name]; `start` is what counts when a number or colour is wanted instead
// when   (scene, light) -> whether it matters; off otherwise

const number = (path, label, low, high, step, tip, more) => ({
  kind: 'number',
  path,
  label,
  low,
  high,
  step,
  tip,
  ...more,
})
const logarithmic = (path, label, low, high, tip, more) => ({
  kind: 'number',
  path,
  label,
  low,
  high,
  step: 0.005,
  log: true,
  tip,
  ...more,
})
const colour = (path, label, tip, more) => ({ kind: 'colour', path, label, tip, ...more })
const choice = (path, label, names, tip, more) => ({ kind: 'choice', path, label, names, tip, ...more })
const falloff = (path, label, tip, more) => ({
  kind: 'falloff',
  path,
  label,
  low: -1,
  high: 1,
  step: 0.01,
  tip,
  ...more,
})

const intensity = number('intensity', 'Intensity', 0, 4, 0.01, 'Brighter or darker, this light alone.')
const lightColour = colour('color', 'Colour', 'Tints what this light reaches.')

/** Of the light in hand, by its type. */
export const lightControls = {
  point: [
    number('position.0', 'Across', -0.5, 1.5, 0.005, 'Left and right: shadows fall to the other side.'),
    number('position.1', 'Up', -0.5, 1.5, 0.005, 'Down and up: shadows fall to the other side.'),
    number(
      'position.2',
      'Distance',
      -1,
      2,
      0.005,
      'Near: the light grazes, shadows are long. Below 0 it is behind, and shines through panels (Relief, Back).',
    ),
    intensity,
    lightColour,
  ],
  directional: [
    number('azimuth', 'Azimuth', 0, 360, 1, 'Where the sun stands; shadows point the other way.'),
    number(
      'elevation',
      'Elevation',
      -90,
      90,
      0.5,
      'Low: long shadows and strong relief. High: flat. Below 0 it is behind.',
    ),
    intensity,
    lightColour,
  ],
  environment: [
    number('rotation.0', 'Turn', -180, 180, 1, 'Turns the surroundings about the vertical.'),
    number('rotation.1', 'Tilt', -90, 90, 1, 'Tips the surroundings forward.'),
    number('intensity', 'Intensity', 0, 10, 0.01, 'Auto exposes any surroundings alike.', {
      words: [['auto', 'Auto']],
      start: 1,
    }),
    choice(
      'weighting',
      'Weighting',
      { 'solid-angle': 'Solid angle', uniform: 'Uniform' },
      'Uniform lets the poles of the image count for more than they cover.',
    ),
    number('radius', 'Radius', 0.1, 5, 0.01, 'A near sphere lights the middle and the rims differently.', {
      words: [[null, 'Far']],
      start: 1,
    }),
  ],
}

const exponential = ({ material }) => material.illumination === 'exponential'

/** Of the scene, by the group they stand in. */
export const sceneControls = {
  material: [
    logarithmic('material.depth', 'Depth t', 0.0005, 0.2, 'Small is crisp stone or metal, large is soft wax and skin.'),
    choice(
      'material.illumination',
      'Fades by',
      { length: 'Length', exponential: 'Absorption', count: 'Count' },
      'Length is the plain model; absorption makes wax, jade and marble; count is the thesis’s own program.',
    ),
    logarithmic(
      'material.attenuation',
      'Attenuation',
      1,
      500,
      'How quickly light dies inside: small glows, large is opaque.',
      { when: exponential },
    ),
    number('material.steps', 'Steps', 1, 300, 1, 'Few are quick and banded.', {
      when: ({ material }) => material.illumination === 'count',
    }),
    choice(
      'material.offset',
      'Offset',
      { normal: 'Normal', view: 'View' },
      'Along the view, slopes that face sideways gain light.',
    ),
    colour('material.diffuseColor', 'Diffuse', 'The colour of lit matter.'),
    colour('material.baseColor', 'Shadow', 'The colour of what no light reaches.'),
    colour('material.specularColor', 'Highlight', 'Of metals their own colour, of all else white.'),
    number('material.specular.k', 'Highlight k', 0, 1, 0.01, 'From matt to mirror-like.'),
    falloff(
      'material.specular.falloff',
      'Highlight falloff',
      'Far apart: a broad sheen. Both near 1: a small, sharp spot.',
      { when: ({ material }) => material.specular.k > 0 },
    ),
    {
      kind: 'check',
      path: 'material.specular.occlude',
      label: 'Shadows cut highlights',
      tip: 'Without it highlights shine in the shade too.',
      when: ({ material }) => material.specular.k > 0,
    },
    number('material.scatter.k', 'Scatter k', 0, 1, 0.01, 'How much the glow needs the light straight behind.'),
    falloff(
      'material.scatter.falloff',
      'Scatter falloff',
      'Far apart: the glow spreads. Both near 1: only round the light.',
      { when: ({ material }) => material.scatter.k > 0 },
    ),
  ],
  relief: [
    logarithmic('relief', 'Height', 0.005, 2, 'How far white stands out from black; higher throws longer shadows.'),
    number('normalScale', 'Slopes', 0, 5, 0.01, 'Exaggerates the fine relief that highlights show.'),
    number(
      'base',
      'Back',
      -0.5,
      0.5,
      0.001,
      'Ground lets no light through. A panel has a back, and glows with a light behind it.',
      {
        words: [
          ['none', 'Ground'],
          ['auto', 'Panel'],
        ],
        start: -0.05,
      },
    ),
  ],
  finish: [
    number('output.exposure', 'Exposure', -4, 4, 0.05, 'Stops: one more is twice as bright.'),
    choice('output.tone', 'Tone', { clip: 'Clip', filmic: 'Filmic' }, 'Filmic keeps bright places from burning out.'),
    choice(
      'output.transfer',
      'Transfer',
      { srgb: 'sRGB', none: 'None' },
      'None: numbers as they are, as the thesis’s program had them.',
    ),
    colour('output.background', 'Background', 'What lies under the picture where the relief has none.', {
      words: [[null, 'Clear']],
      start: '#808080',
    }),
  ],
  export: [
    choice(
      'output.format',
      'Format',
      { png: 'PNG', jpeg: 'JPEG', webp: 'WebP', exr: 'EXR' },
      'EXR keeps linear light, for compositing.',
    ),
    number('output.bitDepth', 'Bits', 8, 32, 8, '16 keep smooth shades smooth when they are graded later.', {
      words: [[null, 'Usual']],
      start: 16,
      plain: true,
    }),
    number('output.quality', 'Quality', 1, 100, 1, 'Lower is a smaller file with more traces of it.', {
      when: ({ output }) => output.format === 'jpeg' || output.format === 'webp',
    }),
    choice('output.effort', 'Effort', { fast: 'Fast', small: 'Small file' }, 'The same picture, sooner or smaller.'),
    number('output.width', 'Width', 64, 8192, 1, 'Pixels of the file; the picture on the page has the screen’s.', {
      words: [[null, 'As the map']],
      start: 1024,
      plain: true,
    }),
    number('output.height', 'Height', 64, 8192, 1, 'Alone or with the width, which it may distort.', {
      words: [[null, 'In proportion']],
      start: 1024,
      plain: true,
    }),
  ],
}

/** Names of the layers, in the order in which they explain the picture. */
export const layerNames = {
  beauty: 'Picture',
  illumination: 'Light d',
  thickness: 'Path r',
  specular: 'Highlight s',
  scatter: 'Scatter f',
  normal: 'Normals',
  height: 'Height',
  alpha: 'Mask',
}

/** A number as people read it: as many digits as its slider can tell apart. */
export function shownNumber(value, { log, step }) {
  if (log) return String(Number(value.toPrecision(3)))
  const digits = Math.min(6, Math.max(0, Math.ceil(-Math.log10(step))))
  return String(Number(value.toFixed(digits)))
}

/** Where on its slider a value is, and back. */
export const toSlider = (value, { log }) => (log ? Math.log10(Math.max(value, 1e-12)) : value)
export const fromSlider = (value, { log }) => (log ? Number((10 ** value).toPrecision(3)) : value)
