// What the server says of the fields of a scene: ranges, words, defaults and a sentence each, read from its OpenAPI
// document, so that no control of the studio can disagree with it.

const lightKinds = { PointLight: 'point', DirectionalLight: 'directional', EnvironmentLight: 'environment' }

/**
 * @return  Map of dotted path -> {sentence, default, integer, low, high, lowExcluded, choices, most: entries of a list,
 *          start: of an object or null what an object begins as}; what a field has not is undefined. Fields of lights begin
 *          with the light's type: "point.intensity". Numbers of lists have the list's range.
 */
export function readFields(api) {
  const { schemas } = api.components
  const fields = new Map()
  const follow = (properties, prefix) => {
    for (const [name, node] of Object.entries(properties)) {
      const members = membersOf(node)
      if (!node.properties) fields.set(prefix + name, { ...described(node), start: members && defaultsOf(members) })
      if (members) follow(members, `${prefix}${name}.`)
    }
  }
  follow(schemas.Scene.properties, '')
  for (const [name, type] of Object.entries(lightKinds)) follow(schemas[name].properties, `${type}.`)
  return fields
}

/** The fields of a medium that is given by its numbers, as readFields() has those of a scene. */
export const readMediumFields = ({ components }) =>
  new Map(Object.entries(membersOf(components.schemas.Medium)).map(([name, node]) => [name, described(node)]))

/** The members of an object, or of the object that a field may be. */
const membersOf = ({ properties, anyOf = [], oneOf = [] }) =>
  properties ?? [...anyOf, ...oneOf].find((part) => part.properties)?.properties

const defaultsOf = (members) =>
  Object.fromEntries(Object.entries(members).map(([name, node]) => [name, node.default]))

function described(node) {
  const parts = [node, ...(node.anyOf ?? []), ...(node.items ? [node.items] : [])]
  const number = parts.find(({ type }) => type === 'number' || type === 'integer') ?? {}
  const words = parts.flatMap((part) => part.enum ?? (part.const !== undefined ? [part.const] : []))
  return {
    sentence: node.description ?? '',
    default: node.default,
    integer: number.type === 'integer',
    low: number.minimum ?? number.exclusiveMinimum,
    high: number.maximum,
    lowExcluded: number.exclusiveMinimum !== undefined,
    choices: words.length ? words : undefined,
    most: node.maxItems,
  }
}

/** "above 0, at most 10; usually 0.008" of a field, or nothing. */
export function spokenRange(field) {
  const parts = []
  if (field.low !== undefined && field.high < 1e6)
    parts.push(field.lowExcluded ? `above ${field.low}, at most ${field.high}` : `${field.low} to ${field.high}`)
  if (field.default !== undefined && !Array.isArray(field.default)) parts.push(`usually ${field.default ?? 'none'}`)
  return parts.join('; ')
}

/** The defaults of every kind of light, as shortened() of scene.js takes them. */
export function lightDefaults(fields) {
  const of = (type) =>
    Object.fromEntries(
      [...fields].flatMap(([path, field]) =>
        path.startsWith(type + '.') && field.default !== undefined
          ? [[path.slice(type.length + 1), field.default]]
          : [],
      ),
    )
  return { point: of('point'), directional: of('directional'), environment: of('environment') }
}

/** A number that the server takes: the nearest in the field's range, whole where it has to be. */
export function allowed(number, field) {
  if (!Number.isFinite(number)) return null
  const inside = Math.min(Math.max(number, field.low ?? -Infinity), field.high ?? Infinity)
  const whole = field.integer ? Math.round(inside) : inside
  return field.lowExcluded && whole <= field.low ? null : whole
}
