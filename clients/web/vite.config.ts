import { defineConfig } from 'vite';

// `npm run dev` serves the sources and passes the WebSocket on to a daemon: LUMEND=127.0.0.1:9460 npm run dev
const daemon = process.env.LUMEND ?? '127.0.0.1:9460';

export default defineConfig({
    base: './',
    build: {
        target: 'es2021',
        // No polyfill and no inlined assets: the page runs under a CSP without 'unsafe-inline' and data: fonts.
        modulePreload: false,
        assetsInlineLimit: 0,
        reportCompressedSize: false,
    },
    server: { proxy: { '/ws': { target: `ws://${daemon}`, ws: true, changeOrigin: true } } },
});
