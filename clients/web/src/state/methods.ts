/** The ways in which the server can make a picture. */
import { isObject, type Json } from '../protocol/rpc';
import { stringOr } from '../protocol/types';

export interface Method {
    name: string;
    summary: string;
    /** A picture at rest gets better, and its error is known. */
    addsSamples: boolean;
    /** That it computes, where they are called for. */
    effects: readonly string[];
}

export function methodsIn(list: Json | undefined): Method[] {
    const rows = Array.isArray(list) ? list.filter(isObject) : [];
    return rows.map((m) => ({
        name: stringOr(m.name, ''),
        summary: stringOr(m.summary, ''),
        addsSamples: m.progressive === true || m.refines === true,
        effects: Array.isArray(m.effects) ? m.effects.map((e) => stringOr(e, '')) : [],
    }));
}
