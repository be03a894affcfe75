/**
 * lumend from TypeScript and JavaScript: edit a scene, see its pictures, measure its light.
 *
 *     import { connect } from 'lumend';
 *
 *     const session = await connect('http://127.0.0.1:9460/#t=TOKEN');
 *     await session.edit((edit) => edit.set('ceiling-panel', { flux_lm: 5500 }));
 *     const view = await session.view(600, 400, { spp: 64 });
 *     const png = await (await view.picture()).png();
 *     await session.close();
 */
export { Edit, type Fields } from './edit.js';
export type { Answers, CameraPose, Params, PhotometryOfWeb, SensorValue, SessionLimits, ViewMembers } from './messages.js';
export { Picture } from './picture.js';
export type { Added, FrameStats, Method, Records, Transform } from './records.js';
export { ClosedError, RpcError } from './rpc.js';
export { connect, Session, View, type ConnectOptions, type SceneRecord } from './session.js';
