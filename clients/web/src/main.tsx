import { render } from 'preact';
import { App } from './state/app';
import { takeToken } from './state/token';
import './style/main.css';
import { AppContext } from './ui/context';
import { Layout } from './ui/Layout';

function socketUrl(): string {
    const url = new URL('ws', location.href);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    url.hash = url.search = '';
    return url.href;
}

const app = new App(socketUrl(), takeToken());
render(
    <AppContext.Provider value={app}>
        <Layout />
    </AppContext.Provider>,
    document.getElementById('app')!,
);
