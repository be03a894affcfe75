import { fixed, si } from '../lib/format';
import { useApp } from './context';

/** What the last frame was made of: effects the scene does not call for are listed too, with the reason, and cost nothing. */
export function EffectsPanel() {
    const app = useApp();
    const effects = app.meter.server.value?.effects ?? [];
    if (effects.length === 0) return null;
    return (
        <details class="section effects">
            <summary>
                <h2>What this frame cost</h2>
            </summary>
            <table>
                <thead>
                    <tr>
                        <th scope="col">Effect</th>
                        <th scope="col">Rays</th>
                        <th scope="col">CPU ms</th>
                    </tr>
                </thead>
                <tbody>
                    {effects.map((e) => (
                        <tr key={e.name} class={e.on ? '' : 'is-off'} title={e.why}>
                            <th scope="row">
                                {e.name.replace(/_/g, ' ')}
                                {e.why && <small>{e.why}</small>}
                            </th>
                            <td>{e.rays === 0 ? '0' : si(e.rays)}</td>
                            <td>{e.ms === 0 ? '0' : fixed(e.ms, 1)}</td>
                        </tr>
                    ))}
                </tbody>
            </table>
        </details>
    );
}
