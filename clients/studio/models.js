// The models of a material: what each does, in words, and what has to change along when another one is chosen. Plain
// functions, no page.
import { withMember } from './scene.js'

/** All models, in the order in which they are explained. */
export const models = [
  {
    name: 'integrated',
    title: 'Integrated',
    by: 'Perumal 2017',
    does:
      'How far light has come through the relief on its straight way tells how bright a place is: crisp or soft by the ' +
      'depth t. Light never leaves beside where it went in, and there is no medium. The quickest.',
  },
  {
    name: 'dipole',
    title: 'Dipole',
    by: 'Jensen and others 2001',
    does:
      'Light enters, scatters, spreads and leaves all around, coloured by the medium. Two sources, one below the ' +
      'surface and one above it, stand for all of that.',
  },
  {
    name: 'better-dipole',
    title: 'Better dipole',
    by: 'd’Eon 2012',
    does:
      'The same with a truer boundary and a truer diffusion: better in media that absorb much, such as dark skin, ' +
      'juice or ketchup. In bright ones hardly another picture.',
  },
  {
    name: 'directional-dipole',
    title: 'Directional dipole',
    by: 'Frisvad and others 2014',
    does:
      'Light that comes in aslant goes on aslant below the surface, which a low sun shows best. As published it gives ' +
      'back more light than the others, in very bright media more than came in; matched, as much as the better dipole.',
  },
  {
    name: 'normalised-diffusion',
    title: 'Normalised diffusion',
    by: 'Christensen and Burley 2015',
    does:
      'A curve fitted to simulations of light: sharper close to where light enters, soft further out. What it gives ' +
      'back is exactly the medium’s albedo.',
  },
]

/** What all but the integrated model have in common, said plainly. */
export const caution =
  'None of these is the truth. Dipoles take the relief for a flat, deep block around the place where light enters: beside ' +
  'a simulation of light they are 10 to 30 % off near that place, in media that absorb much, and where the relief is thin ' +
  'or strongly curved. A light behind a panel is taken to shine on its back evenly all around.'

/** Whether light is carried below the surface of the scene, which may be a short one. */
export const isTranslucent = ({ material }) => (material?.model ?? 'integrated') !== 'integrated'

const counts = ({ material }) => material.illumination === 'count'

/** Whether the scene has a layer, by its word. */
export function hasLayer(scene, layer) {
  if (layer === 'subsurface' || layer === 'highlight') return isTranslucent(scene)
  if (layer === 'irradiance') return !counts(scene)
  if (layer === 'thickness') return !counts(scene) && scene.lights[0].type !== 'environment'
  return true
}

/** The scene with what it cannot have replaced: samples counted below a surface, layers that it has not. */
export function workable(scene) {
  const lit =
    isTranslucent(scene) && counts(scene) ? withMember(scene, 'material.illumination', 'length') : scene
  return hasLayer(lit, lit.output.layer) ? lit : withMember(lit, 'output.layer', 'beauty')
}

export const withModel = (scene, model) => workable(withMember(scene, 'material.model', model))

const usualHighlight = 0.2

/** With the model's own kind of highlight, as strong as the scene has it or else the usual; or without any. */
export function withHighlight(scene, shines) {
  const path = isTranslucent(scene) ? 'material.highlight.k' : 'material.specular.k'
  const { specular, highlight } = scene.material
  if (shines) return (isTranslucent(scene) ? highlight : specular).k > 0 ? scene : withMember(scene, path, usualHighlight)
  return withMember(withMember(scene, 'material.specular.k', 0), 'material.highlight.k', 0)
}

/** With another lobe. What nt and nb are is not the same for Lafortune's as for the others: they begin anew then. */
export function withLobe(scene, lobe) {
  const { highlight } = scene.material
  const isOther = (lobe === 'lafortune') !== (highlight.lobe === 'lafortune')
  const sharpness = lobe === 'lafortune' ? { nt: -1, nb: -1 } : { nt: 10, nb: 10 }
  return withMember(scene, 'material.highlight', { ...highlight, ...(isOther && sharpness), lobe })
}

/** Degrees at which the sun of explaining pictures stands. */
export const elevations = [5, 15, 30, 45, 60, 85]

/** The scene as it explains a model: its relief and its medium under a sun, with or without highlights. */
export const explainingScene = (scene, model, elevation, shines) => ({
  ...withHighlight(withModel(scene, model), shines),
  lights: [{ type: 'directional', azimuth: 315, elevation, color: '#ffffff', intensity: 1 }],
})
