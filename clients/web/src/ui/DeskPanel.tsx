import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { numberOr, stringOr } from '../protocol/types';
import { CHANNELS, inWords, LAST_CHANNEL, widthOf } from '../state/desk';
import { Choice } from './Choice';
import { useApp } from './context';
import { Editing } from './Editing';
import { Icon } from './Icon';
import { NumberField } from './NumberField';
import { useDeskIsShown } from './SectionNav';

const ASK_EVERY_MS = 1000;
const PROTOCOLS: [string, string][] = [
    ['sacn', 'sACN'],
    ['artnet', 'Art-Net'],
];

/** Which channels of a lighting desk control what. Only where there is one, or could be. */
export function DeskPanel() {
    const app = useApp();
    const target = useSignal('');
    const status = app.desk.status.value;
    const ids = app.scene.list('patch').value;
    const listens = status !== null;
    const shown = useDeskIsShown();
    useEffect(() => {
        if (!listens) return;
        const timer = setInterval(() => {
            if (!document.hidden && app.online.value) app.desk.ask();
        }, ASK_EVERY_MS);
        return () => clearInterval(timer);
    }, [listens]);
    if (!shown) return null;
    const targets = targetsOf(app.scene.lamps.value.map((id) => [id, stringOr(app.scene.record(id)?.group, '')]));
    const chosen = targets.some(([id]) => id === target.value) ? target.value : (targets[0]?.[0] ?? '');
    return (
        <section class="section" aria-labelledby="desk-title">
            <Editing>
                <header class="section-head">
                    <h2 id="desk-title">Desk</h2>
                    <button type="button" class="toggle at-end" aria-label="Add patch" disabled={chosen === ''} onClick={() => app.desk.add(chosen)}>
                        Add
                    </button>
                </header>
                {!listens && <p class="hint">This server listens to no desk: it was started without --sacn and --artnet.</p>}
                <Choice label="Lamp or group" value={chosen} options={targets} onChange={(id) => (target.value = id)} />
                {status?.universes.map((u) => (
                    <p key={`${u.protocol} ${u.number}`} class="hint">
                        {u.protocol === 'sacn' ? 'sACN' : 'Art-Net'} universe {u.number}: {inWords(u)}
                    </p>
                ))}
                {status !== null && status.dropped > 0 && <p class="hint">{status.dropped} packets came faster than they could be read.</p>}
                <ul class="light-list">
                    {ids.map((id) => (
                        <Patch key={id} id={id} />
                    ))}
                </ul>
            </Editing>
        </section>
    );
}

/** Groups first, each once. */
function targetsOf(lamps: [string, string][]): [string, string][] {
    const groups = [...new Set(lamps.map(([, group]) => group).filter((group) => group !== ''))];
    return [...groups.map((g): [string, string] => [g, `${g} (group)`]), ...lamps.map(([id]): [string, string] => [id, id])];
}

function Patch({ id }: { id: string }) {
    const { desk, edits, scene } = useApp();
    const record = scene.record(id);
    if (!record) return null;
    const target = stringOr(record.target, '');
    return (
        <li class="light">
            <div class="light-head">
                <span class="light-name">{target}</span>
                <button type="button" class="icon-button" aria-label={`Remove the patch of ${target}`} title="Remove" onClick={() => desk.remove(id)}>
                    <Icon name="close" />
                </button>
            </div>
            <div class="fields">
                <Choice
                    label="Protocol"
                    value={stringOr(record.protocol, 'sacn')}
                    options={PROTOCOLS}
                    onChange={(v) => edits.setOnce(id, '/protocol', v)}
                />
                <Choice label="Channels" value={stringOr(record.channels, 'dim')} options={CHANNELS} onChange={(v) => edits.setOnce(id, '/channels', v)} />
            </div>
            <div class="fields">
                <NumberField
                    label="Universe"
                    unit=""
                    min={record.protocol === 'artnet' ? 0 : 1}
                    max={record.protocol === 'artnet' ? 32767 : 63999}
                    step={1}
                    value={numberOr(record.universe, 1)}
                    onCommit={(v) => edits.setOnce(id, '/universe', v)}
                />
                <NumberField
                    label="Channel"
                    unit=""
                    min={1}
                    max={LAST_CHANNEL + 1 - widthOf(record)}
                    step={1}
                    value={numberOr(record.address, 1)}
                    onCommit={(v) => edits.setOnce(id, '/address', v)}
                />
            </div>
        </li>
    );
}
