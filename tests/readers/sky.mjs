// What engines show of the sky that `export-engine` writes for them, toward the axes and between them, and how its lights shine.
// node sky.mjs FOLDER CHROMIUM, in the folder of node_modules; FOLDER/sky/ENGINE and FOLDER/sun-light/ENGINE have the files of each.
// The light of the first toward d, of which y is up and z the centre of a lat-long image, is 2 + 1.5 d. The other is a sun that
// became a light, of which FOLDER/sun.json has the direction and the irradiance. Prints lines as readers.mjs does.

import fs from 'fs';
import { openBrowser } from './browser.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const axes = [ [ 1, 0, 0 ], [ 0, 1, 0 ], [ 0, 0, 1 ] ];
// Not along the edges of faces, where software renderers take one for the other.
const between = [ [ 0.91, 0.83, 0.77 ], [ - 0.97, 0.51, 0.31 ], [ 0.23, - 0.81, 0.97 ] ];
const directions = [ ...axes, ...between ].flatMap( ( d ) => [ d, d.map( ( x ) => - x ) ] ).map( ( d ) => d.map( ( x ) => x / Math.hypot( ...d ) ) );
// What lies in a direction of the engine's world, and how far rounding may take it: Filament draws in eight bits, .env is PNG.
const engines = {
	three: [ ( [ x, y, z ] ) => [ - z, y, x ], 0.01 ],
	babylon: [ ( [ x, y, z ] ) => [ - x, y, z ], 0.05 ],
	filament: [ ( d ) => d, 0.05 ],
};

const sun = JSON.parse( fs.readFileSync( `${folder}/sun.json` ) );
const dot = ( a, b ) => a.reduce( ( sum, x, k ) => sum + x * b[ k ], 0 );

const { browser, address, close } = await openBrowser( folder, chromium );

/** The largest error of what the page of an engine shows toward the directions, of the values that are wanted. */
async function worst( engine, files, wanted, ...options ) {

	const page = await browser.newPage();
	page.on( 'pageerror', ( error ) => console.error( engine, error ) );
	page.on( 'requestfailed', ( request ) => console.error( engine, request.url(), request.failure().errorText ) );
	await page.goto( `${address}/sky.html?engine=${engine}&files=${files}` );
	await page.waitForFunction( 'window.look', { timeout: 120000, polling: 500 } );
	let error = 0;
	for ( const direction of directions ) {

		const found = await page.evaluate( ( ...given ) => window.look( ...given ), direction, ...options );
		error = Math.max( error, ...wanted( direction ).map( ( x, c ) => Math.abs( x - found[ c ] ) ) );

	}

	await page.close();
	return error;

}

const judged = ( error, most ) => error.toExponential( 1 ) + ( error < most ? '' : ' WRONG' );
try {

	for ( const [ engine, [ shown, rounding ] ] of Object.entries( engines ) ) {

		const sky = await worst( engine, 'sky', ( d ) => shown( d ).map( ( x ) => 2 + 1.5 * x ), false );
		console.log( `${engine}\tsky/${engine}\t${judged( sky, rounding )} of 0.5 to 3.5, behind a scene` );
		if ( engine === 'babylon' ) {

			// A white matte surface that faces the camera: a cosine keeps two thirds of what depends on the direction.
			const error = await worst( engine, 'sky', ( d ) => shown( d ).map( ( x ) => 2 - x ), true, true );
			console.log( `${engine}\tsky/${engine}\t${judged( error, 0.03 )} of 1 to 3, a matte surface under the cube of irradiance` );

		}

		if ( engine === 'filament' ) continue; // its README has lights in C++
		// A surface that faces a camera that looks in this direction, lit from the other side of it.
		const lit = ( d ) => sun.irradiance.map( ( e ) => e / Math.PI * Math.max( 0, - dot( shown( d ), sun.direction ) ) );
		const brightest = Math.max( ...sun.irradiance ) / Math.PI;
		const error = await worst( engine, 'sun-light', lit, true ) / brightest;
		console.log( `${engine}\tsun-light/${engine}\t${judged( error, 0.01 )} of a white surface that faces the sun` );

	}

} finally {

	await close();

}
