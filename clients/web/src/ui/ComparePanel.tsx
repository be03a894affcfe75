import { useEffect, useRef } from 'preact/hooks';
import { factsInWords, sameCamera, type Kept, type Side } from '../state/compare';
import { orbitFromPose } from '../view/camera';
import { Choice } from './Choice';
import { useApp } from './context';
import { Icon } from './Icon';

const THUMB_HEIGHT = 40;

/** Pictures that were kept, and what the picture is compared with. */
export function ComparePanel() {
    const app = useApp();
    const { compare } = app;
    const kept = compare.kept.value;
    return (
        <section class="section compare" aria-labelledby="compare-title">
            <header class="section-head">
                <h2 id="compare-title" title="Two pictures in one, with a line between them that you drag">
                    Compare
                </h2>
                <button type="button" class="toggle at-end" title="Keeps it in this page until that is closed" onClick={() => compare.keep()}>
                    Keep this picture
                </button>
            </header>
            <button type="button" class="toggle" aria-expanded={app.pastOpen.value} title="What the scene was, edit by edit" onClick={() => (app.pastOpen.value = !app.pastOpen.value)}>
                Timeline
            </button>
            {kept.length === 0 && <p class="hint">Keep a picture, change the light, and drag a line between before and after.</p>}
            {compare.sides.value && <Sides sides={compare.sides.value} />}
            <ul class="kept-list">
                {[...kept].reverse().map((k) => (
                    <Row key={k.key} kept={k} />
                ))}
            </ul>
            <dl class="compare-with">
                {compare.before.value && <With side="before" name="Before" what="As it was before your last change, an undo too." />}
                <With side="reference" name="Reference" what="The same light path traced, and exact in the end; the server works on it beside yours while it is shown." />
            </dl>
        </section>
    );
}

function With({ side, name, what }: { side: Side; name: string; what: string }) {
    const { compare } = useApp();
    const shown = compare.sides.value?.includes(side) ?? false;
    return (
        <div>
            <dt>
                <button type="button" class="toggle" aria-pressed={shown} onClick={() => (shown ? compare.close() : compare.show(side))}>
                    {name}
                </button>
            </dt>
            <dd class="hint">{what}</dd>
        </div>
    );
}

/** Any two. */
function Sides({ sides }: { sides: readonly [Side, Side] }) {
    const { compare } = useApp();
    const options: [string, string][] = [
        ['now', 'Now'],
        ...(compare.before.value ? [['before', 'Before'] as [string, string]] : []),
        ['reference', 'Reference'],
        ...(compare.moment.value ? [['moment', compare.moment.value.name] as [string, string]] : []),
        ...compare.kept.value.map((k): [string, string] => [String(k.key), k.name]),
    ];
    const choose = (which: 0 | 1, value: string): void => compare.choose(which, /^\d+$/.test(value) ? Number(value) : (value as Side));
    return (
        <div class="choices">
            <Choice label="Left of the line" value={String(sides[0])} options={options} onChange={(v) => choose(0, v)} />
            <Choice label="Right of it" value={String(sides[1])} options={options} onChange={(v) => choose(1, v)} />
        </div>
    );
}

function Row({ kept }: { kept: Kept }) {
    const app = useApp();
    const { compare } = app;
    const { key, name, facts, at } = kept;
    const shown = compare.sides.value?.includes(key) ?? false;
    const elsewhere = !sameCamera(facts.pose, app.view.shownPose.value);
    return (
        <li class="kept-row">
            <Thumb kept={kept} />
            <div class="kept-body">
                <div class="kept-head">
                    <input
                        type="text"
                        class="kept-name"
                        aria-label={`Name of ${name}`}
                        title="Name it"
                        maxLength={40}
                        value={name}
                        onChange={(e) => {
                            compare.rename(key, e.currentTarget.value);
                            e.currentTarget.value = compare.keptOf(key)?.name ?? '';
                        }}
                    />
                    <button type="button" class="icon-button" aria-label={`Forget ${name}`} title="Forget it" onClick={() => compare.forget(key)}>
                        <Icon name="close" />
                    </button>
                </div>
                <small>
                    {at.toLocaleTimeString([], { hour: '2-digit', minute: '2-digit' })}, {factsInWords(facts)}
                </small>
                <div class="kept-actions">
                    <button
                        type="button"
                        class="toggle"
                        aria-label={`Wipe between ${name} and now`}
                        aria-pressed={shown}
                        onClick={() => (shown ? compare.close() : compare.show(key))}
                    >
                        Wipe
                    </button>
                    {elsewhere && (
                        <button
                            type="button"
                            class="toggle"
                            aria-label={`Go to the camera of ${name}`}
                            title="It was seen from elsewhere: go there"
                            onClick={() => app.view.moveTo(orbitFromPose(facts.pose))}
                        >
                            Its camera
                        </button>
                    )}
                    <button type="button" class="toggle" aria-label={`Save ${name} as PNG`} title="Save it as a PNG file" onClick={() => app.downloads.picture(kept)}>
                        PNG
                    </button>
                </div>
            </div>
        </li>
    );
}

function Thumb({ kept: { canvas } }: { kept: Kept }) {
    const small = useRef<HTMLCanvasElement>(null);
    useEffect(() => {
        const ratio = window.devicePixelRatio;
        const to = small.current!;
        to.height = Math.round(THUMB_HEIGHT * ratio);
        to.width = Math.round((to.height * canvas.width) / canvas.height);
        const context = to.getContext('2d', { alpha: false });
        if (!context) return;
        context.imageSmoothingQuality = 'high';
        context.drawImage(canvas, 0, 0, to.width, to.height);
    }, [canvas]);
    return <canvas ref={small} class="kept-thumb" aria-hidden="true" />;
}
