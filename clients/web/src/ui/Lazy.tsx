import { useSignal } from '@preact/signals';
import { createElement, type ComponentType } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { useApp } from './context';

/** By what loads them: a part that was fetched is there at once the next time. */
const fetched = new Map<unknown, unknown>();

interface Props<P> {
    /** It is wanted. Once it was, it stays: what it shows is its own matter. */
    when: boolean;
    /** The same function each time. */
    load(): Promise<ComponentType<P>>;
    with: P;
}

/** A part of the page that is fetched when it is first wanted: the page itself stays light. */
export function Lazy<P extends object>({ when, load, with: props }: Props<P>) {
    const app = useApp();
    const arrived = useSignal(0);
    const wanted = useRef(false);
    const part = fetched.get(load) as ComponentType<P> | undefined;
    useEffect(() => {
        if (!when || fetched.has(load)) return;
        load().then(
            (loaded) => {
                fetched.set(load, loaded);
                arrived.value++;
            },
            () => app.toasts.error(new Error('A part of the page could not be fetched: load the page again')),
        );
    }, [when]);
    void arrived.value;
    wanted.current ||= when;
    return part && wanted.current ? createElement(part, props) : null;
}
