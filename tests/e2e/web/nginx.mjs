// nginx with the site of docker/proxy for several daemons, each at its path, on a port of its own.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { connect, createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { eventually } from './browser.mjs';

const SITE = fileURLToPath(new URL('../../../docker/proxy/nginx-scenes.conf', import.meta.url));
export const NGINX = [process.env.LUMEND_NGINX, '/usr/sbin/nginx', '/usr/bin/nginx'].find((path) => path && existsSync(path));

function freePort() {
    return new Promise((resolve) => {
        const server = createServer().listen(0, '127.0.0.1', () => {
            const { port } = server.address();
            server.close(() => resolve(port));
        });
    });
}

function answers(port) {
    return new Promise((resolve) => {
        const socket = connect(port, '127.0.0.1', () => resolve(true)).on('error', () => resolve(false));
        socket.on('connect', () => socket.destroy());
    });
}

export class Nginx {
    /** daemons: in the order of the site's ports. certificate: of certificate.mjs. Resolves when it listens, at https://localhost:PORT. */
    async start(daemons, certificate) {
        const folder = mkdtempSync(join(tmpdir(), 'lumend-e2e-'));
        this.port = await freePort();
        let site = readFileSync(SITE, 'utf8');
        const change = (before, after) => {
            if (!site.includes(before)) throw new Error(`nginx-scenes.conf has no ${before}`);
            site = site.replaceAll(before, after);
        };
        change('listen 80;', `listen 127.0.0.1:${await freePort()};`);
        change('listen 443 ssl', `listen 127.0.0.1:${this.port} ssl`);
        change('/etc/ssl/private/lights.example.key', certificate.key);
        change('/etc/ssl/lights.example.pem', certificate.file);
        daemons.forEach(({ port }, i) => change(`127.0.0.1:${9460 + i}`, `127.0.0.1:${port}`));
        const temporary = ['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((kind) => `${kind}_temp_path ${folder}/${kind};`).join(' ');
        const main = join(folder, 'main.conf');
        const settings = `pid ${folder}/pid; error_log ${folder}/error; daemon off; worker_processes 1; events { }`;
        writeFileSync(main, `${settings}\nhttp { access_log off; ${temporary}\n${site}\n}\n`);
        let log = '';
        this.child = spawn(NGINX, ['-p', folder, '-e', join(folder, 'error'), '-c', main], { stdio: ['ignore', 'ignore', 'pipe'] });
        this.child.stderr.on('data', (chunk) => (log += chunk));
        this.exited = new Promise((resolve) => this.child.on('exit', resolve));
        await eventually(async () => {
            if (this.child.exitCode !== null) throw new Error(`nginx ended\n${log}`);
            return answers(this.port);
        }, () => `nginx does not listen\n${log}`);
    }

    async stop() {
        this.child?.kill('SIGTERM');
        await this.exited;
    }
}
