// What a page draws, compared with the still of the same from the CPU.

import fs from 'fs';

/** The pixels of a picture along an edge, and of the stills around it (page.toml). */
export const SIZE = 200;
const MARGIN = 16, GAP = 12;
export const MODES = [ 'taps', 'local-shrm', 'cabral', 'kautz-mccool', 'prefiltered', 'table', 'irradiance', 'mirror' ];
const NEAR = 3, SHARE = 0.99;

const round = ( degrees ) => ( degrees * Math.PI / 180 ).toFixed( 4 );
/** The camera and the light of the stills. */
export const camera = { yaw: round( 40 ), pitch: round( 20 ), turn: round( 60 ), tilt: round( 10 ) };

/** In the page: the codes of its canvas, or of a part of a picture. */
export const codesOfCanvas = () => {

	const canvas = document.getElementById( 'canvas' );
	const copy = new OffscreenCanvas( canvas.width, canvas.height ).getContext( '2d' );
	copy.drawImage( canvas, 0, 0 );
	return [ ...copy.getImageData( 0, 0, canvas.width, canvas.height ).data ];

};
const codesOfPicture = async ( source, x, y, size ) => {

	const picture = new Image();
	picture.src = source;
	await picture.decode();
	const copy = new OffscreenCanvas( size, size ).getContext( '2d' );
	copy.drawImage( picture, x, y, size, size, 0, 0, size, size );
	return [ ...copy.getImageData( 0, 0, size, size ).data ];

};

/** The pixels whose neighbours in a picture are like them. */
function inner( codes ) {

	const pixels = [];
	for ( let y = 1; y < SIZE - 1; y ++ ) for ( let x = 1; x < SIZE - 1; x ++ ) {

		const values = [ 0, 1, 2 ].map( ( c ) => [ - 1, 0, 1 ].flatMap( ( row ) => [ - 1, 0, 1 ].map(
			( column ) => codes[ 4 * ( ( y + row ) * SIZE + x + column ) + c ] ) ) );
		if ( values.every( ( of ) => Math.max( ...of ) - Math.min( ...of ) < 12 ) ) pixels.push( y * SIZE + x );

	}

	return pixels;

}

/** Compares what a page draws with the part of a still that has a mode: what is said of it. */
export const comparedWithStill = ( page, still, mode ) => comparedWithPicture( page, still, [ MARGIN + MODES.indexOf( mode ) * ( SIZE + GAP ), MARGIN ] );

/** Compares what a page draws with a picture, of which it is the part at a place: what is said of it. Codes may be off by `near`. */
export async function comparedWithPicture( page, still, [ x, y ] = [ 0, 0 ], near = NEAR ) {

	const source = `data:image/png;base64,${fs.readFileSync( still ).toString( 'base64' )}`;
	const expected = await page.evaluate( codesOfPicture, source, x, y, SIZE );
	const drawn = await page.evaluate( codesOfCanvas );
	const pixels = inner( expected );
	const off = pixels.map( ( pixel ) => Math.max( ...[ 0, 1, 2 ].map( ( c ) => Math.abs( expected[ 4 * pixel + c ] - drawn[ 4 * pixel + c ] ) ) ) );
	off.sort( ( a, b ) => a - b );
	const [ half, most ] = [ 0.5, SHARE ].map( ( share ) => off[ Math.floor( share * off.length ) ] );
	const verdict = pixels.length < 0.2 * SIZE * SIZE ? ' WRONG: nothing to compare' : most > near ? ` WRONG: more than ${near}` : '';
	return `half within ${half}, 99 % within ${most} of 255${verdict}`;

}

/** Gives the picture of a page so many pixels along an edge, each of which is then drawn. */
export async function resize( page, size ) {

	// What puppeteer itself waits with is source that is evaluated in the page, which its policy forbids and Firefox prevents.
	await page.evaluate( async ( size ) => {

		const stage = document.getElementById( 'stage' );
		stage.style.cssText = `position: fixed; inset: 0 auto auto 0; width: ${size}px; height: ${size}px; min-height: 0; z-index: 9`;
		specula.isExact = true;
		const canvas = document.getElementById( 'canvas' );
		const isReady = () => document.documentElement.dataset.ready === 'true' && canvas.width === size;
		while ( ! isReady() ) await new Promise( requestAnimationFrame );

	}, size );

}

/** Shows a state, and waits until it is drawn. */
export async function show( page, changes ) {

	await page.evaluate( async ( changes ) => {

		set( readFragment( new URLSearchParams( changes ).toString() ) );
		const before = specula.drawn;
		const canvas = document.getElementById( 'canvas' );
		while ( specula.drawn === before || canvas.getAttribute( 'aria-busy' ) ) await new Promise( requestAnimationFrame );
		await new Promise( requestAnimationFrame );

	}, changes );

}
