// The page at /docs: what /openapi.json says, for people. Knows OpenAPI 3.1 and nothing of this server.

const methods = ['get', 'put', 'post', 'delete', 'patch', 'head', 'options']

/** An element of a name, attributes and children (elements, text, or nothing). */
function make(name, attributes, ...children) {
  const element = Object.assign(document.createElement(name), attributes)
  element.append(...children.flat(2).filter((child) => child != null && child !== ''))
  return element
}
const code = (text) => make('code', {}, text)
const link = (href, text) => make('a', { href }, text)

/** Sentences with `code` in them. */
const prose = (text = '') => text.split('`').map((part, i) => (i % 2 ? code(part) : part))

/** Paragraphs, each perhaps followed by a list of lines that begin with "- ". */
function paragraphs(text = '') {
  return text.split(/\n\s*\n/).flatMap((part) => {
    const [head, ...items] = part.split(/^- /m)
    const list = items.length ? make('ul', {}, items.map((item) => make('li', {}, prose(item)))) : ''
    return [head.trim() ? make('p', {}, prose(head)) : '', list]
  })
}

/** A table of rows of cells; columns in which no row says anything are left out. */
function table(titles, rows) {
  const said = titles.map((_, column) => rows.some((row) => [row[column]].flat().some((part) => part != null && part !== '')))
  if (!rows.length) return ''
  const line = (kind) => (row) => make('tr', {}, row.filter((_, i) => said[i]).map((cell) => make(kind, {}, cell)))
  const parts = [make('thead', {}, line('th')(titles)), make('tbody', {}, rows.map(line('td')))]
  return make('div', { className: 'scroll' }, make('table', {}, parts))
}

let api = {}

/** What a $ref stands for; its own sentences go before those of its target. */
function resolved(node = {}) {
  if (!node.$ref) return node
  const { $ref, ...own } = node
  const target = $ref.slice(2).split('/').reduce((at, key) => at?.[key.replaceAll('~1', '/').replaceAll('~0', '~')], api)
  return { ...resolved(target), ...own }
}
const refName = (node) => node?.$ref?.split('/').at(-1)
const anchor = (name) => `schema-${name}`

const constraints = (s) => [
  s.minimum != null && `≥ ${s.minimum}`,
  s.exclusiveMinimum != null && `> ${s.exclusiveMinimum}`,
  s.maximum != null && `≤ ${s.maximum}`,
  s.exclusiveMaximum != null && `< ${s.exclusiveMaximum}`,
  s.pattern && `like ${s.pattern}`,
  s.format,
].filter(Boolean).join(', ')

/** A schema's type in a few words, with links to the schemas that have a name. */
function typeOf(node = {}) {
  if (node.$ref) return [link(`#${anchor(refName(node))}`, refName(node))]
  const choices = node.oneOf ?? node.anyOf ?? node.allOf
  if (choices) return choices.flatMap((choice, i) => (i ? [' or ', ...typeOf(choice)] : typeOf(choice)))
  if (node.const !== undefined) return [code(JSON.stringify(node.const))]
  if (node.enum?.length > 16) return [`one of ${node.enum.length} words, as `, code(JSON.stringify(node.enum[0]))]
  if (node.enum) return node.enum.flatMap((word, i) => [i ? ' or ' : '', code(JSON.stringify(word))])
  const types = [node.type ?? (node.properties ? 'object' : 'anything')].flat().join(' or ')
  const limits = constraints(node)
  const kind = limits ? `${types} ${limits}` : types
  if (!node.items && !node.prefixItems) return [kind]
  const count = node.minItems != null && node.minItems === node.maxItems ? `${node.minItems} × ` : ''
  return [`${kind} of `, count, ...typeOf(node.items || node.prefixItems[0])]
}

/** The members of an object, those of allOf among them. */
function membersOf(node) {
  const schema = resolved(node)
  const merged = { ...schema.properties }
  for (const part of schema.allOf ?? []) Object.assign(merged, membersOf(part))
  return merged
}

/** What counts where nothing is given. */
const fallback = (schema, required) =>
  schema.default === undefined ? (required ? 'required' : '') : code(JSON.stringify(schema.default))

/** A row per field: dotted path, type, default, sentence. Objects without a name of their own are followed. */
function fieldRows(schema, path = '') {
  const required = resolved(schema).required ?? []
  return Object.entries(membersOf(schema)).flatMap(([name, node]) => {
    const field = resolved(node)
    const whole = path + name
    const row = [code(whole), typeOf(node), fallback(field, required.includes(name)), prose(field.description)]
    return node.$ref ? [row] : [row, ...fieldRows(node, `${whole}.`)]
  })
}

function alternatives(schema) {
  const several = schema.oneOf ?? schema.anyOf
  return several ? make('p', {}, 'One of: ', typeOf({ oneOf: several })) : ''
}

/** All examples of a media type or parameter, as [name, value]. */
function examplesOf(holder = {}) {
  const named = Object.entries(holder.examples ?? {}).map(([name, e]) => [e.summary ?? name, resolved(e).value])
  const own = holder.example !== undefined ? [['', holder.example]] : []
  const schema = resolved(holder.schema)
  const ofSchema = schema.examples?.map((value) => ['', value]) ?? (schema.example !== undefined ? [['', schema.example]] : [])
  return [...named, ...own, ...ofSchema].filter(([, value]) => value !== undefined)
}
const asText = (value) => (typeof value === 'string' ? value : JSON.stringify(value, null, 2))

const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`

/** How curl is told the body; files are called by what they are. */
function bodyWords(type, media, value) {
  if (type === 'application/json') return [`--json ${quoted(JSON.stringify(value ?? {}))}`]
  if (type !== 'multipart/form-data') return ['--data-binary @image.png']
  const schema = resolved(media.schema)
  const parts = Object.entries(schema.properties ?? {}).map(([name, part]) =>
    [name, part.contentMediaType === 'application/json' ? '@scene.json' : '@image.png'])
  if (schema.additionalProperties) parts.push(['name', '@image.png'])
  return Object.entries(value ?? Object.fromEntries(parts)).map(([name, part]) =>
    `-F ${name}=${String(part).startsWith('@') ? part : quoted(asText(part))}`)
}

/** A command line that makes the call. */
function curl(method, path, operation, type, media, value) {
  const parameters = (operation.parameters ?? []).map(resolved)
  const sample = (p) => examplesOf(p)[0]?.[1] ?? resolved(p.schema).enum?.[0] ?? `{${p.name}}`
  const filled = parameters.filter((p) => p.in === 'path')
    .reduce((at, p) => at.replace(`{${p.name}}`, sample(p)), path)
  const query = parameters.filter((p) => p.in === 'query' && (p.required || examplesOf(p).length))
    .map((p) => `${p.name}=${encodeURIComponent(sample(p))}`).join('&')
  const verb = method === 'get' || (method === 'post' && type) ? [] : [`-X ${method.toUpperCase()}`]
  const picture = Object.keys(resolved(operation.responses?.[200]).content ?? {}).some((kind) => kind.startsWith('image/'))
  const words = ['curl', ...verb, quoted(location.origin + filled + (query && `?${query}`)), picture ? '-o picture' : '',
    ...(type ? bodyWords(type, media, value) : [])]
  return make('pre', {}, code(words.filter(Boolean).join(' ')))
}

function bodySection(method, path, operation) {
  const kinds = Object.entries(resolved(operation.requestBody).content ?? {})
  if (!kinds.length) return curl(method, path, operation)
  return kinds.flatMap(([type, media]) => {
    const named = refName(media.schema)
    const examples = examplesOf(media)
    return [
      make('h4', {}, 'Body: ', code(type), named ? [' ', ...typeOf(media.schema)] : ''),
      named ? '' : paragraphs(media.schema?.description),
      named ? '' : table(['field', 'type', 'default', 'meaning'], fieldRows(media.schema ?? {})),
      examples.flatMap(([name, value]) => [make('p', {}, name), curl(method, path, operation, type, media, value)]),
      examples.length ? '' : curl(method, path, operation, type, media),
    ].flat()
  })
}

function replyRow([status, node]) {
  const reply = resolved(node)
  const kinds = Object.entries(reply.content ?? {}).flatMap(([type, media], i) => [
    i ? make('br') : '', code(type), media.schema?.$ref ? [' ', typeOf(media.schema)].flat() : '',
  ].flat())
  const headers = Object.keys(reply.headers ?? {}).flatMap((name, i) => [i ? ', ' : '', code(name)])
  return [code(status), prose(reply.description), kinds, headers]
}

const callAnchor = (method, path) => `${method}-${path}`.replaceAll(/[^\w]+/g, '-')

function callSection(path, method, operation, shared) {
  const all = { ...operation, parameters: [...shared, ...(operation.parameters ?? [])] }
  const parameters = all.parameters.map(resolved).map((p) => [
    code(p.name), p.in, typeOf(p.schema), fallback(resolved(p.schema), p.required), prose(p.description),
  ])
  const title = make('h3', {}, make('span', { className: 'method' }, method.toUpperCase()), code(path))
  return make('section', { id: callAnchor(method, path) }, title,
    make('p', {}, prose(operation.summary)), paragraphs(operation.description),
    table(['parameter', 'in', 'type', 'default', 'meaning'], parameters),
    bodySection(method, path, all),
    table(['reply', 'meaning', 'content', 'headers'], Object.entries(operation.responses ?? {}).map(replyRow)))
}

function schemaSection([name, schema]) {
  const examples = examplesOf({ schema })
  const plain = Object.keys(membersOf(schema)).length === 0 && !schema.oneOf && !schema.anyOf
  return make('section', { id: anchor(name) }, make('h3', {}, name), paragraphs(schema.description),
    alternatives(schema), plain ? make('p', {}, typeOf(schema)) : '',
    table(['field', 'type', 'default', 'meaning'], fieldRows(schema)),
    examples.map(([, value]) => make('pre', {}, code(asText(value)))))
}

function page() {
  const calls = Object.entries(api.paths ?? {}).flatMap(([path, item]) =>
    methods.filter((method) => item[method]).map((method) => [path, method, item[method], item.parameters ?? []]))
  const contents = calls.map(([path, method, { summary }]) => make('li', {},
    make('span', { className: 'method' }, method.toUpperCase()), link(`#${callAnchor(method, path)}`, code(path))))
  return [
    ...paragraphs(api.info?.description),
    make('h2', {}, 'Calls'), make('ul', { className: 'contents' }, contents),
    ...calls.map((call) => callSection(...call)),
    make('h2', {}, 'Fields'), ...Object.entries(api.components?.schemas ?? {}).map(schemaSection),
  ].filter((part) => part !== '')
}

try {
  const reply = await fetch('/openapi.json')
  if (!reply.ok) throw new Error(`the server answered ${reply.status}`)
  api = await reply.json()
  document.getElementById('version').textContent = `${api.info?.title ?? ''} ${api.info?.version ?? ''}`
  document.getElementById('content').replaceChildren(...page())
  if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView()
} catch (error) {
  document.getElementById('status').textContent = `The description could not be read: ${error.message}.`
}
