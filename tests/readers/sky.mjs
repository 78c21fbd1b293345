// What engines show of the sky that `export-engine` writes for them, toward the axes and between them.
// node sky.mjs FOLDER CHROMIUM, in the folder of node_modules; FOLDER/sky/ENGINE has the files of each. The light toward d,
// of which y is up and z the centre of a lat-long image, is 2 + 1.5 d. Prints a line for each engine, as readers.mjs does.

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

const { browser, address, close } = await openBrowser( folder, chromium );
try {

	for ( const [ engine, [ shown, rounding ] ] of Object.entries( engines ) ) {

		const page = await browser.newPage();
		page.on( 'pageerror', ( error ) => console.error( engine, error ) );
		page.on( 'requestfailed', ( request ) => console.error( engine, request.url(), request.failure().errorText ) );
		await page.goto( `${address}/sky.html?engine=${engine}` );
		await page.waitForFunction( 'window.look', { timeout: 120000, polling: 500 } );
		let worst = 0;
		for ( const direction of directions ) {

			const found = await page.evaluate( ( direction ) => window.look( direction ), direction );
			const wanted = shown( direction ).map( ( x ) => 2 + 1.5 * x );
			worst = Math.max( worst, ...wanted.map( ( x, c ) => Math.abs( x - found[ c ] ) ) );

		}

		console.log( `${engine}\tsky/${engine}\t${worst.toExponential( 1 )} of 0.5 to 3.5, behind a scene${worst < rounding ? '' : ' WRONG'}` );
		await page.close();

	}

} finally {

	await close();

}
