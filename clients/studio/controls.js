// The controls of the studio, a row each: which field of the scene, how it is called, how far its slider goes. Ranges, words
// and what a field means come from the server (fields.js); `tip` says what it does to the picture. Fields of lights are those
// of the light in hand. A slider spans what is commonly wanted; the number beside it takes all that the server takes.
//
// kind   number      a slider and a number
//        falloff     two thumbs and two numbers
//        colour      a colour picker
//        choice      one of the field's words; `names` of them for people; `allows` (word, scene) -> whether it can be had
//        pick        the same as a list to open
//        check       yes or no; of a field that is an object or null, whether there is one
//        medium      a medium by its name or by its numbers (mediumControls)
//        size        a number in mm, and what it means for the reach of light
// words  values beside the control's own, as [value, name]; `start` is what counts when a number or colour is wanted instead
// shown  (scene) -> whether the row is there
// when   (scene) -> whether it matters; off otherwise
// put    (scene, value) -> the scene with it, where more than the field changes
// head   words above the row
import { isTranslucent, models, withLobe, withModel } from './models.js'

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
const pick = (path, label, names, tip, more) => ({ kind: 'pick', path, label, names, tip, ...more })
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
const isIntegrated = (scene) => !isTranslucent(scene)
const isDirectional = ({ material }) => material.model === 'directional-dipole'
const hasFilm = (scene) => isTranslucent(scene) && scene.material.film !== null
const hasLobe =
  (...lobes) =>
  (scene) =>
    isTranslucent(scene) && lobes.includes(scene.material.highlight.lobe)
const shines = ({ material }) => material.highlight.k > 0

/** Of a medium that is given by its numbers. */
export const mediumControls = {
  sigmaA: { label: 'Absorbs', tip: 'What a colour loses on its way: the picture is darker, and in the other colours.' },
  sigmaS: { label: 'Scatters', tip: 'Much: light turns back soon, the thing is milky. Little: it goes far.' },
  g: { label: 'Forward g', tip: 'Scattered mostly onwards, light goes further.' },
  eta: { label: 'Index', tip: 'Glass has 1.5, water 1.33. More mirrors more light away at the surface.' },
}

// What the models of subsurface scattering take beside the rest of a material.
const translucentControls = [
  {
    kind: 'medium',
    path: 'material.medium',
    label: 'Medium',
    tip: 'Gives the colour, and how far light goes in it.',
    shown: isTranslucent,
  },
  {
    ...logarithmic(
      'material.mmPerWidth',
      'Optical size',
      1,
      5000,
      'The same relief as a small thing or a large one. Small: light goes through much of it. Large: it is opaque.',
    ),
    kind: 'size',
    shown: isTranslucent,
  },
  choice(
    'material.dirdipoleEnergy',
    'Gives back',
    { published: 'As published', matched: 'As the better dipole' },
    'As published the lit side is brighter than with the other models, in bright media brighter than the light.',
    { shown: isDirectional },
  ),
  number('material.bssrdfWeight', 'From below', 0, 2, 0.01, 'How much of the light that comes back from below is shown.', {
    shown: isTranslucent,
  }),
  number('material.diffuseWeight', 'Matt', 0, 1, 0.01, 'Adds a dry, crisp surface, as of chalk dust or scales.', {
    shown: isTranslucent,
  }),
  {
    kind: 'check',
    path: 'material.film',
    label: 'Film on the surface',
    tip: 'A thin layer of another medium, such as skin over flesh: veils it at the rims and takes some of its light.',
    shown: isTranslucent,
  },
  {
    kind: 'medium',
    path: 'material.film.medium',
    label: 'Film of',
    tip: 'Dark media shade what is below them, bright ones veil it.',
    shown: hasFilm,
  },
  logarithmic('material.film.thickness', 'Thickness', 0.0005, 1, 'In mm. Thin is hardly seen, thick hides what is below.', {
    shown: hasFilm,
  }),
  number('material.film.g', 'Film g', -0.9, 0.9, 0.01, 'Below 0 the film throws light back: a silvery veil.', {
    words: [[null, 'Its own']],
    start: 0.5,
    shown: hasFilm,
  }),
  number('material.highlight.k', 'Gloss k', 0, 2, 0.01, 'Highlights of the light itself, over the colour of the medium.', {
    shown: isTranslucent,
    head: 'Gloss',
  }),
  choice(
    'material.highlight.transport',
    'Gloss leaves',
    { local: 'Where it enters', subsurface: 'Around' },
    'Around: a highlight soft as the medium, by the optical size. Where it enters: a polished surface.',
    { shown: isTranslucent, when: shines },
  ),
  pick(
    'material.highlight.lobe',
    'Lobe',
    { cosine: 'Cosine', ward: 'Ward', ashikhmin: 'Ashikhmin and Shirley', lafortune: 'Lafortune' },
    'Cosine is a plain round spot; Ward brushed; Ashikhmin and Shirley stronger at grazing light; Lafortune any lean.',
    { shown: isTranslucent, when: shines, put: withLobe },
  ),
  logarithmic('material.highlight.nt', 'Sharp, up', 1, 1000, 'Low: a broad sheen up and down. High: a small spot.', {
    shown: hasLobe('ward', 'ashikhmin'),
    when: shines,
  }),
  logarithmic('material.highlight.nb', 'Sharp, across', 1, 1000, 'Low: a broad sheen from side to side. High: a small spot.', {
    shown: hasLobe('ward', 'ashikhmin'),
    when: shines,
  }),
  number('material.highlight.nt', 'Lean, up', -1, 1, 0.01, '-1 mirrors, 0 leaves out, 1 turns back to the light.', {
    shown: hasLobe('lafortune'),
    when: shines,
  }),
  number('material.highlight.nb', 'Lean, across', -1, 1, 0.01, '-1 mirrors, 0 leaves out, 1 turns back to the light.', {
    shown: hasLobe('lafortune'),
    when: shines,
  }),
  logarithmic('material.highlight.exponent', 'Exponent', 1, 1000, 'Low: a broad sheen. High: a small, sharp spot.', {
    shown: hasLobe('cosine', 'lafortune'),
    when: shines,
  }),
]

/** Of the scene, by the group they stand in. */
export const sceneControls = {
  material: [
    pick(
      'material.model',
      'Model',
      Object.fromEntries(models.map(({ name, title }) => [name, title])),
      'The integrated model darkens along one way through the relief; the others let light spread below the surface.',
      { put: withModel },
    ),
    ...translucentControls,
    logarithmic('material.depth', 'Depth t', 0.0005, 0.2, 'Small is crisp stone or metal, large is soft wax and skin.', {
      head: 'Shadows and colours',
    }),
    choice(
      'material.illumination',
      'Fades by',
      { length: 'Length', exponential: 'Absorption', count: 'Count' },
      'Length is the plain model; absorption makes wax, jade and marble; count is the thesis’s own program.',
      { allows: (word, scene) => word !== 'count' || isIntegrated(scene) },
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
      shown: isIntegrated,
    }),
    choice(
      'material.offset',
      'Offset',
      { normal: 'Normal', view: 'View' },
      'Along the view, slopes that face sideways gain light.',
      { shown: isIntegrated },
    ),
    colour('material.diffuseColor', 'Diffuse', 'The colour of lit matter; over a medium a tint.'),
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
    logarithmic('bumpRelief', 'Bumps', 0.0005, 0.2, 'How far white stands out from black in the bump map.', {
      when: ({ bump }) => bump,
    }),
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
  irradiance: 'Irradiance E',
  subsurface: 'From below L',
  highlight: 'Gloss H',
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
