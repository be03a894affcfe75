// node run.mjs build/release/bin/lumend NAME [pattern]: the browser tests of NAME.test.mjs. Exit status 77: skipped, and why.
import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { CHROMIUM } from './browser.mjs';

const [lumend, name, pattern] = process.argv.slice(2);
if (!name) {
    console.error('usage: node run.mjs PATH-OF-LUMEND FILE [NAME-PATTERN]');
    process.exit(2);
}
if (!existsSync(CHROMIUM)) {
    console.log(`skipped: no ${CHROMIUM}`);
    process.exit(77);
}
const file = fileURLToPath(new URL(`${name}.test.mjs`, import.meta.url));
const only = pattern ? [`--test-name-pattern=${pattern}`] : [];
const run = spawnSync(process.execPath, ['--test', ...only, file], { stdio: 'inherit', env: { ...process.env, LUMEND: lumend } });
process.exit(run.status ?? 1);
