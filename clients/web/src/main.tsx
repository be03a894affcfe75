import { render } from 'preact';
import { App } from './state/app';
import { projectInAddress } from './state/projects';
import { takeToken, tokenInAddress } from './state/token';
import './style/main.css';
import { AppContext } from './ui/context';
import { Layout } from './ui/Layout';

function socketUrl(): string {
    const url = new URL('ws', location.href);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    url.hash = url.search = '';
    return url.href;
}

const app = new App(socketUrl(), takeToken(), projectInAddress());
// An address with another token, or another view, put into the tab where the page is: only its end changes, and nothing is loaded anew.
addEventListener('hashchange', () => {
    const token = tokenInAddress();
    if (token !== null) app.useToken(token);
    app.calledFor(location.hash);
});
render(
    <AppContext.Provider value={app}>
        <Layout />
    </AppContext.Provider>,
    document.getElementById('app')!,
);
