// Unit tests: *.test.ts beside what they test, bundled by esbuild and run by node's own test runner.
import { spawnSync } from 'node:child_process';
import { readdirSync, rmSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const root = fileURLToPath(new URL('..', import.meta.url));
const out = `${root}node_modules/.cache/test`;

function find(folder) {
    return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
        const path = `${folder}/${entry.name}`;
        if (entry.isDirectory()) return find(path);
        return entry.name.endsWith('.test.ts') ? [path] : [];
    });
}

rmSync(out, { recursive: true, force: true });
await build({
    entryPoints: find(`${root}src`),
    outdir: out,
    outbase: `${root}src`,
    bundle: true,
    platform: 'node',
    format: 'esm',
    outExtension: { '.js': '.mjs' },
    logLevel: 'warning',
});
const bundles = readdirSync(out, { withFileTypes: true })
    .filter((e) => e.isDirectory())
    .flatMap((e) => readdirSync(`${out}/${e.name}`).map((f) => `${out}/${e.name}/${f}`));
const run = spawnSync(process.execPath, ['--test', ...bundles], { stdio: 'inherit' });
process.exit(run.status ?? 1);
