import { useEffect, useRef } from 'preact/hooks';
import { useApp } from './context';

/** Makes what others have to open to see this picture: camera, method, effects, exposure, map. */
export function CopyLink() {
    const { sharing } = useApp();
    return (
        <button type="button" class="toggle at-end" title="To this scene, seen and shown as it is here. Who opens it needs a token of their own" onClick={() => void sharing.copy()}>
            Copy link
        </button>
    );
}

/** Where the browser lets no page copy. */
export function LinkByHand() {
    const { sharing } = useApp();
    const link = sharing.byHand.value;
    const field = useRef<HTMLInputElement>(null);
    useEffect(() => {
        field.current?.focus();
        field.current?.select();
    }, [link]);
    if (link === null) return null;
    return <input ref={field} type="text" readOnly aria-label="Link to this view, to be copied" value={link} onBlur={() => (sharing.byHand.value = null)} />;
}
