/** What this browser reads of what a server may send over a thin line. */

/** As the server makes it: profile 0, any size; values of the screen, all of 0 to 255. Software shows each picture at once, and is there everywhere. */
export const VP9: VideoDecoderConfig = {
    codec: 'vp09.00.51.08.01.01.13.01.01',
    hardwareAcceleration: 'prefer-software',
    optimizeForLatency: true,
    colorSpace: { primaries: 'bt709', transfer: 'iec61966-2-1', matrix: 'bt709', fullRange: true },
};

/** Name of the error of chunks that came after a broken one: all that there is to do about it was done. */
export const PASSED_OVER = 'PassedOver';

/** Name of the error of chunks that became neither pictures nor errors: more of them would not either. */
export const SILENT = 'Silent';

/** Not of a page that came without TLS from elsewhere, nor of older browsers. */
export async function readsVp9(): Promise<boolean> {
    if (typeof VideoDecoder === 'undefined') return false;
    return VideoDecoder.isConfigSupported(VP9).then((answer) => answer.supported === true, () => false);
}
