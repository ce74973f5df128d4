// What is published: size, contents, types.
import assert from 'node:assert/strict'
import { execFileSync } from 'node:child_process'
import { readFile, readdir } from 'node:fs/promises'
import { test } from 'node:test'
import { fileURLToPath } from 'node:url'
import { gzipSync } from 'node:zlib'
import * as relit from '../../clients/js/relit.js'
import * as jobs from '../../clients/js/relit-jobs.js'

const folder = new URL('../../clients/js/', import.meta.url)
const read = (name) => readFile(new URL(name, folder), 'utf8')

test('relit.js is at most 5 KB gzipped, as it is served and published', async (t) => {
  const size = async (name) => gzipSync(await read(name), { level: 9 }).length
  t.diagnostic(`gzipped: relit.js ${await size('relit.js')} bytes, relit-jobs.js ${await size('relit-jobs.js')} bytes`)
  assert.ok(await size('relit.js') <= 5 * 1024)
})

test('nothing is imported from outside the package', async () => {
  const imports = (text) => [...text.matchAll(/^(?:import|export) .*from '([^']+)'/gm)].map(([, from]) => from)
  assert.deepEqual(imports(await read('relit.js')), [])
  assert.deepEqual(imports(await read('relit-jobs.js')), ['./relit.js'])
})

test('the package names the files that it has, with the licence and the version of the project', async () => {
  const { files, version, license, type, exports: entries, ...others } = JSON.parse(await read('package.json'))
  const there = await readdir(folder)
  assert.deepEqual([...files, 'README.md', 'package.json'].sort(), there.sort())
  for (const entry of Object.values(entries).flatMap(Object.values)) assert.ok(files.includes(entry.slice(2)), entry)
  assert.deepEqual([license, type, others.dependencies, others.scripts], ['MIT', 'module', undefined, undefined])
  assert.equal(await read('LICENSE'), await read('../../LICENSE'))
  assert.match(await read('../../CMakeLists.txt'), new RegExp(`project\\(relit VERSION ${version} `))
})

test('the types are those of the modules: they compile with an example of use, and name every export', async () => {
  const compiler = fileURLToPath(new URL('node_modules/typescript/bin/tsc', import.meta.url))
  const project = fileURLToPath(new URL('tsconfig.json', import.meta.url))
  execFileSync(process.execPath, [compiler, '--project', project], { stdio: ['ignore', 'inherit', 'inherit'] })
  const declared = (text) => [...text.matchAll(/^export (?:class|function) (\w+)/gm)].map(([, name]) => name).sort()
  assert.deepEqual(declared(await read('index.d.ts')), Object.keys(relit).sort())
  assert.deepEqual(declared(await read('relit-jobs.d.ts')), Object.keys(jobs).sort())
})
