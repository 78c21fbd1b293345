// Whether three.js shows the light of probes that `export-probes` writes for it: node probes.mjs FOLDER CHROMIUM, in the folder of
// node_modules; FOLDER/out has what probes.toml makes. At 200 places with normals the radiance of a white matte surface is compared
// with the coefficients of the same probes in a glTF file, blended and summed here in Specula's frame, and that of the axes with the
// formula of the manual page. Prints lines as readers.mjs does: the largest error, in shares of the brightest colour.

import fs from 'fs';
import { openBrowser } from './browser.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const MOST = 1e-3, PLACES = 200;
const hall = { from: [ - 1, 2, 0.5 ], to: [ 3, 5, 2.5 ], counts: [ 5, 3, 4 ] };
const cases = {
	axes: { from: [ - 2, - 1.5, 0 ], to: [ 2, 1.5, 2 ], counts: [ 5, 4, 3 ] },
	noise: hall,
	corners: { ...hall, corners: true },
};
const axes = [ 0, 1, 2 ];

// --- What is expected, in Specula's frame --------------------------------------------------------------------

/** The nine coefficients of each probe, x fastest, from the points of a glTF file. */
function rowsOf( file ) {

	const bytes = fs.readFileSync( file ), length = bytes.readUInt32LE( 12 );
	const json = JSON.parse( bytes.subarray( 20, 20 + length ) ), begin = 28 + length;
	const { attributes } = json.meshes[ 0 ].primitives[ 0 ];
	const numbers = ( name ) => {

		const { bufferView, count } = json.accessors[ attributes[ name ] ];
		const at = begin + json.bufferViews[ bufferView ].byteOffset;
		return Array.from( { length: count }, ( _, k ) => axes.map( ( c ) => bytes.readFloatLE( at + 4 * ( 3 * k + c ) ) ) );

	};

	const names = [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 1, 2 ], [ 2, 0 ], [ 2, 1 ], [ 2, 2 ], [ 2, 3 ], [ 2, 4 ] ];
	const rows = names.map( ( [ l, n ] ) => numbers( `_SH_DEGREE_${l}_COEF_${n}` ) );
	return rows[ 0 ].map( ( _, probe ) => rows.map( ( row ) => row[ probe ] ) );

}

const spacingOf = ( { from, to, counts, corners } ) => axes.map( ( k ) => ( to[ k ] - from[ k ] ) / ( corners ? counts[ k ] - 1 : counts[ k ] ) );

/** What a white matte surface reflects of probes that are blended at a place. */
function reflected( volume, rows, at, [ x, y, z ] ) {

	const { from, counts, corners } = volume, spacing = spacingOf( volume );
	const places = axes.map( ( k ) => Math.min( Math.max( ( at[ k ] - from[ k ] ) / spacing[ k ] - ( corners ? 0 : 0.5 ), 0 ), counts[ k ] - 1 ) );
	const pi = Math.PI, a = Math.sqrt( 1 / pi ) / 2, b = Math.sqrt( 3 / pi ) / 3, c = Math.sqrt( 15 / pi ) / 8, d = Math.sqrt( 5 / pi ) / 16;
	const basis = [ a, b * y, b * z, b * x, c * x * y, c * y * z, d * ( 3 * z * z - 1 ), c * x * z, c * ( x * x - y * y ) / 2 ];
	const sum = [ 0, 0, 0 ];
	for ( let corner = 0; corner < 8; corner ++ ) {

		let weight = 1;
		const cell = axes.map( ( k ) => {

			const below = Math.min( Math.floor( places[ k ] ), counts[ k ] - 2 ), upper = corner >> k & 1;
			weight *= upper ? places[ k ] - below : 1 - places[ k ] + below;
			return below + upper;

		} );
		const own = rows[ ( cell[ 2 ] * counts[ 1 ] + cell[ 1 ] ) * counts[ 0 ] + cell[ 0 ] ];
		own.forEach( ( row, k ) => axes.forEach( ( channel ) => { sum[ channel ] += weight * basis[ k ] * row[ channel ]; } ) );

	}

	return sum;

}

/** A number from 0 to 1 for each index. */
const noise = ( k ) => { const x = Math.sin( 12.9898 * k + 4.1414 ) * 43758.5453; return x - Math.floor( x ); };

/** Places with normals, of which each sample, half a spacing along the normal, is in the volume. */
function placesIn( volume ) {

	const { from, to } = volume, spacing = spacingOf( volume );
	return Array.from( { length: PLACES }, ( _, k ) => {

		const d = axes.map( ( axis ) => noise( 3 * k + axis ) - 0.5 ), normal = d.map( ( x ) => x / Math.hypot( ...d ) );
		const sample = axes.map( ( axis ) => from[ axis ] + ( 0.02 + 0.96 * noise( 7000 + 3 * k + axis ) ) * ( to[ axis ] - from[ axis ] ) );
		return { normal, sample, at: axes.map( ( axis ) => sample[ axis ] - spacing[ axis ] * normal[ axis ] / 2 ) };

	} );

}

const toFile = ( [ x, y, z ] ) => [ y, z, x ];

/** The formula of probe-pattern: 2 + u + n / 2, in the axes of files; u as far as there are probes to blend. */
function ofAxes( volume, { normal, sample } ) {

	const { from, to, counts } = volume;
	return toFile( axes.map( ( k ) => {

		const u = 2 * ( sample[ k ] - from[ k ] ) / ( to[ k ] - from[ k ] ) - 1, most = 1 - 1 / counts[ k ];
		return 2 + Math.min( Math.max( u, - most ), most ) + normal[ k ] / 2;

	} ) );

}

// --- What three.js shows -------------------------------------------------------------------------------------

const { browser, address, close } = await openBrowser( folder, chromium );
try {

	for ( const [ version, gpu ] of [ [ 'three', '' ], [ 'three', '&gpu' ], [ 'three186', '' ], [ 'three184', '' ] ] ) {

		if ( ! fs.existsSync( `node_modules/${version}/examples/jsm/lighting/LightProbeGrid.js` ) ) {

			console.error( `SKIPPED light probes of ${version}: it is not installed` );
			continue;

		}

		const page = await browser.newPage();
		page.on( 'console', ( message ) => message.text().startsWith( 'THREE.' ) && console.error( message.text() ) );
		page.on( 'pageerror', ( error ) => console.error( version, error ) );
		await page.goto( `${address}/probes.html?three=${version}${gpu}` );
		await page.waitForFunction( 'window.look', { timeout: 60000, polling: 200 } );
		const reader = await page.evaluate( () => window.reader );
		for ( const [ name, volume ] of Object.entries( cases ) ) {

			const rows = rowsOf( `${folder}/out/${name}/probes.glb` ), places = placesIn( volume );
			const found = await page.evaluate( ( ...given ) => window.look( ...given ), name, places.map( ( { at, normal } ) => [ at, normal ].map( toFile ) ) );
			const expected = places.map( ( { sample, normal } ) => reflected( volume, rows, sample, normal ) );
			const worst = ( wanted ) => Math.max( ...wanted.flatMap( ( colour, k ) => colour.map( ( x, c ) => Math.abs( x - found[ k ][ c ] ) ) ) ) / Math.max( ...wanted.flat() );
			const errors = [ worst( expected ) ];
			if ( name === 'axes' ) errors.push( worst( places.map( ( place ) => ofAxes( volume, place ) ) ) );
			const isRight = errors.every( ( error ) => error < MOST );
			console.log( `${reader}\tprobes/${name}\t${errors.map( ( error ) => error.toExponential( 1 ) ).join( ', ' )} at ${PLACES} places${isRight ? '' : ' WRONG'}` );

		}

		await page.close();

	}

} finally {

	await close();

}
