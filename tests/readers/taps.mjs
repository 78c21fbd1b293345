// Draws with compact maps in three.js and Babylon.js, in headless Chromium, reads the pixels back, and prints
// a line for each comparison: node taps.mjs FOLDER CHROMIUM. The pixels are those of facets, each with a
// normal and a view of its own. Compared are
//
// - the look-ups, with the formula of docs/taps.md in 64-bit numbers, from the `safetensors` of the same
//   pair: the largest error in shares of a pixel's largest colour, and in shares of what 16-bit floats and
//   filters in 256 steps may do; of brushed metal with the tangents of the mesh, then of its coordinates,
// - the whole, with the sum over the pixels of the environment: the errors of 95 and of 99 of 100 colours in
//   stops, beside those of what the engine makes of the environment without taps. Lights are reflected by the
//   formula of the material first, then, as in the picture, by the engine's own, in both the look and the sum.
//
// Directions are in Specula's frame if nothing else is said. Screenshots of the pages go into FOLDER.

import fs from 'fs';
import path from 'path';
import { pathToFileURL } from 'url';
import { openBrowser } from './browser.mjs';
import { CHANNELS, add, compared, cross, dot, facets, formula, namesOf, readTensors, times, unit, views } from './formula.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const load = ( name ) => import( pathToFileURL( path.resolve( 'node_modules', name ) ) );
const said = ( reader, file, text ) => console.log( `${reader}\t${file}\t${text}` );
// --- Brute force -------------------------------------------------------------------------------------------

const COLOUR = [ 0.95, 0.64, 0.54 ], ALPHA = 0.3 ** 2;

// What the facets of a metal that reflects everything reflect toward a cosine: the mean over facets that GGX
// draws.
function albedo( cosine ) {

	const steps = 48, view = [ Math.sqrt( 1 - cosine * cosine ), 0, cosine ];
	const lambda = ( z ) => ( Math.sqrt( 1 + ALPHA ** 2 * ( 1 - z * z ) / ( z * z ) ) - 1 ) / 2;
	let sum = 0;
	for ( let i = 0; i < steps * steps; i ++ ) {

		const u = ( i % steps + 0.5 ) / steps, turn = Math.PI * ( Math.floor( i / steps ) + 0.5 ) / steps;
		const z = Math.sqrt( ( 1 - u ) / ( 1 + ( ALPHA ** 2 - 1 ) * u ) ), side = Math.sqrt( 1 - z * z );
		const h = [ side * Math.cos( turn ), side * Math.sin( turn ), z ], facing = dot( view, h );
		const light = 2 * facing * h[ 2 ] - view[ 2 ];
		if ( facing > 0 && light > 0 ) sum += facing / ( z * cosine * ( 1 + lambda( light ) + lambda( cosine ) ) );

	}

	return sum / steps ** 2;

}

const COSINES = 128;
const lost = Array.from( { length: COSINES + 1 }, ( _, i ) => 1 - albedo( Math.max( i / COSINES, 1e-3 ) ) );
const meanLost = lost.reduce( ( sum, w, i ) => sum + 2 * w * i / COSINES ** 2 * ( i < COSINES ? 1 : 0.5 ), 0 );
const lostAt = ( cosine ) => {

	const i = Math.min( Math.floor( COSINES * cosine ), COSINES - 1 );
	return lost[ i ] + ( COSINES * cosine - i ) * ( lost[ i + 1 ] - lost[ i ] );

};

const several = COLOUR.map( ( f0 ) => {

	const mean = f0 + ( 1 - f0 ) / 21;
	return mean ** 2 * ( 1 - meanLost ) / ( 1 - mean * meanLost ) / ( Math.PI * meanLost );

} );

/**
 * The radiance of the metal under points of light: x, y, z, flux r, g, b of each. Light that facets reflect
 * more than once leaves Specula's `standard` about the normal, and makes the highlight of `engine` brighter,
 * as three.js and Babylon.js have it for lights (Turquin, "Practical multiple scattering compensation for
 * microfacet models").
 */
function reflected( { normal: [ nx, ny, nz ], view: [ vx, vy, vz ] }, points ) {

	const view = nx * vx + ny * vy + nz * vz, a2 = ALPHA ** 2, masked = Math.sqrt( a2 + ( 1 - a2 ) * view * view );
	const once = [ 0, 0, 0 ], again = [ 0, 0, 0 ];
	for ( let k = 0; k < points.length; k += 6 ) {

		const x = points[ k ], y = points[ k + 1 ], z = points[ k + 2 ], light = nx * x + ny * y + nz * z;
		if ( light <= 0 ) continue;
		const lh2 = ( 1 + x * vx + y * vy + z * vz ) / 2, h2 = ( light + view ) ** 2 / ( 4 * lh2 );
		const d = a2 / ( Math.PI * ( 1 - h2 + a2 * h2 ) ** 2 );
		const g = 0.5 / ( light * masked + view * Math.sqrt( a2 + ( 1 - a2 ) * light * light ) );
		const grazing = ( 1 - Math.sqrt( lh2 ) ) ** 5, facets = light * d * g, lostHere = light * lostAt( light );
		for ( let c = 0; c < 3; c ++ ) {

			const flux = points[ k + 3 + c ];
			once[ c ] += flux * facets * ( COLOUR[ c ] + ( 1 - COLOUR[ c ] ) * grazing );
			again[ c ] += flux * lostHere;

		}

	}

	const lostToView = lostAt( view );
	return {
		standard: CHANNELS.map( ( c ) => once[ c ] + several[ c ] * lostToView * again[ c ] ),
		engine: CHANNELS.map( ( c ) => once[ c ] * ( 1 + COLOUR[ c ] * lostToView / ( 1 - lostToView ) ) ),
	};

}

const ALPHAS = [ 0.3 ** 2, 0.5 ** 2 ], N = [ 0.21, 0.91, 1.1 ], K = [ 3.9, 2.4, 2.1 ];

// What a conductor reflects at a cosine.
const conductor = ( cosine, c ) => {

	const sine2 = 1 - cosine * cosine, m = N[ c ] ** 2 - K[ c ] ** 2 - sine2, a2b2 = Math.hypot( m, 2 * N[ c ] * K[ c ] );
	const across = a2b2 + cosine * cosine, along = 2 * cosine * Math.sqrt( ( a2b2 + m ) / 2 ), s = ( across - along ) / ( across + along );
	const far = cosine * cosine * a2b2 + sine2 * sine2, near = along * sine2;
	return s * ( 1 + ( far - near ) / ( far + near ) ) / 2;

};

/** The radiance of the brushed metal, `ggx` with two roughnesses, under such points of light. */
function reflectedByBrushed( { normal, tangent, view }, points ) {

	const across = cross( normal, tangent ), local = ( v ) => [ tangent, across, normal ].map( ( axis ) => dot( v, axis ) );
	const masked = ( [ x, y, z ] ) => Math.hypot( ALPHAS[ 0 ] * x, ALPHAS[ 1 ] * y, z ), v = local( view ), sum = [ 0, 0, 0 ];
	for ( let k = 0; k < points.length; k += 6 ) {

		const l = local( points.subarray( k, k + 3 ) );
		if ( l[ 2 ] <= 0 ) continue;
		const h = unit( add( l, v ) ), slopes = ( h[ 0 ] / ALPHAS[ 0 ] ) ** 2 + ( h[ 1 ] / ALPHAS[ 1 ] ) ** 2 + h[ 2 ] ** 2;
		const d = 1 / ( Math.PI * ALPHAS[ 0 ] * ALPHAS[ 1 ] * slopes ** 2 ), g = 0.5 / ( l[ 2 ] * masked( v ) + v[ 2 ] * masked( l ) );
		for ( let c = 0; c < 3; c ++ ) sum[ c ] += points[ k + 3 + c ] * l[ 2 ] * d * g * conductor( dot( l, h ), c );

	}

	return { standard: sum };

}

/**
 * The pixels of a lat-long picture as points of light. Its centre is +X, its left is +Y. Pixels that are not
 * brighter than `bright` times the mean are joined in fours, which are far smaller than the metal's
 * highlight.
 */
function pointsOf( { data, width, height }, bright = 6 ) {

	const points = [];
	const point = ( row, column, size ) => {

		// three.js's loader has the rows from the bottom.
		const edge = ( row ) => Math.sin( Math.PI * ( row / height - 0.5 ) );
		const z = ( edge( row ) + edge( row + size ) ) / 2, side = Math.sqrt( 1 - z * z ), azimuth = Math.PI * ( 1 - ( 2 * column + size ) / width );
		const flux = [ 0, 0, 0 ];
		for ( let r = row; r < row + size; r ++ ) for ( let c = column; c < column + size; c ++ ) {

			const area = 2 * Math.PI / width * ( edge( r + 1 ) - edge( r ) );
			for ( const k of CHANNELS ) flux[ k ] += area * data[ 4 * ( r * width + c ) + k ];

		}

		points.push( side * Math.cos( azimuth ), side * Math.sin( azimuth ), z, ...flux );

	};

	const least = bright * data.reduce( ( sum, x, k ) => k % 4 < 3 ? sum + x : sum, 0 ) / ( width * height );
	for ( let row = 0; row < height; row += 2 ) for ( let column = 0; column < width; column += 2 ) {

		const four = [ [ 0, 0 ], [ 0, 1 ], [ 1, 0 ], [ 1, 1 ] ].map( ( [ r, c ] ) => [ row + r, column + c ] );
		const isBright = ( [ r, c ] ) => CHANNELS.reduce( ( sum, k ) => sum + data[ 4 * ( r * width + c ) + k ], 0 ) >= least;
		if ( four.some( isBright ) ) four.forEach( ( [ r, c ] ) => point( r, c, 1 ) ); else point( row, column, 2 );

	}

	return Float64Array.from( points );

}

// --- The pages ---------------------------------------------------------------------------------------------

// Both draw facets in a look of a page, 'look-ups' being 'compact' without its lights: each view is a picture
// of cells of 2 x 2 pixels, so that no normal changes within a cell, and one pixel of each is read. They run
// in the page. The mesh has tangents, but for 'look-ups by uv', where it has coordinates that grow along
// `directions`.

async function drawThree( { name, look, views } ) {

	const { THREE, renderer, camera, looks, draw, floats } = window.page;
	const drawn = looks[ name ][ look ] ?? looks[ name ].compact;
	const cells = Math.ceil( Math.sqrt( views[ 0 ].normals.length ) ), size = 2 * cells;
	const target = floats( size, size ), pixels = new Float32Array( 4 * size * size ), found = [];
	if ( look.startsWith( 'look-ups' ) ) for ( const light of drawn.scene.children ) light.visible = false;
	for ( const { view, normals, tangents, directions } of views ) {

		camera.position.set( ...view ).multiplyScalar( 5 );
		camera.lookAt( 0, 0, 0 );
		camera.updateMatrixWorld();
		const positions = [], vectors = [], along = [], coordinates = [];
		normals.forEach( ( normal, k ) => {

			for ( const [ x, y ] of [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 0, 0 ], [ 1, 1 ], [ 0, 1 ] ] ) {

				const place = [ k % cells + x, Math.floor( k / cells ) + y ].map( ( at ) => camera.right * ( 2 * at / cells - 1 ) );
				const position = camera.localToWorld( new THREE.Vector3( ...place, - 5 ) );
				positions.push( ...position );
				vectors.push( ...normal );
				along.push( ...tangents[ k ], 1 );
				coordinates.push( ...directions[ k ].map( ( direction ) => position.dot( new THREE.Vector3( ...direction ) ) ) );

			}

		} );
		const geometry = new THREE.BufferGeometry();
		geometry.setAttribute( 'position', new THREE.Float32BufferAttribute( positions, 3 ) );
		geometry.setAttribute( 'normal', new THREE.Float32BufferAttribute( vectors, 3 ) );
		if ( look === 'look-ups by uv' ) geometry.setAttribute( 'uv', new THREE.Float32BufferAttribute( coordinates, 2 ) );
		else geometry.setAttribute( 'tangent', new THREE.Float32BufferAttribute( along, 4 ) );
		draw( drawn, geometry, new THREE.Vector3( ...view ), target );
		renderer.readRenderTargetPixels( target, 0, 0, size, size, pixels );
		normals.forEach( ( _, k ) => {

			const at = 8 * ( Math.floor( k / cells ) * size + k % cells );
			found.push( [ ...pixels.slice( at, at + 3 ) ] );

		} );
		geometry.dispose();

	}

	for ( const light of drawn.scene.children ) light.visible = true;
	return found;

}

async function drawBabylon( { name, look, views } ) {

	const { BABYLON, looks } = window.page;
	const { scene, camera, material } = looks[ name ][ look ] ?? looks[ name ].compact;
	const cells = Math.ceil( Math.sqrt( views[ 0 ].normals.length ) ), size = 2 * cells, found = [];
	scene.imageProcessingConfiguration.applyByPostProcess = true; // linear colours
	// Babylon.js looks from where the camera is, also if it is orthographic: the facets are so small that it
	// does not matter.
	camera.orthoLeft = camera.orthoBottom = - 1e-4;
	camera.orthoRight = camera.orthoTop = 1e-4;
	for ( const light of scene.lights ) light.setEnabled( ! look.startsWith( 'look-ups' ) );
	const format = { type: BABYLON.Constants.TEXTURETYPE_FLOAT, generateMipMaps: false };
	const target = new BABYLON.RenderTargetTexture( 'target', size, scene, format );
	target.activeCamera = camera;
	for ( const { view, normals, tangents, directions } of views ) {

		camera.position = BABYLON.Vector3.FromArray( view ).scale( 5 );
		camera.setTarget( BABYLON.Vector3.Zero() );
		camera.computeWorldMatrix( true );
		const [ right, up ] = [ 'Right', 'Up' ].map( ( axis ) => camera.getDirection( BABYLON.Vector3[ axis ]() ) );
		const data = new BABYLON.VertexData();
		data.positions = [];
		data.normals = [];
		const along = [], coordinates = [];
		data.indices = normals.flatMap( ( _, k ) => [ 0, 1, 2, 0, 2, 3 ].map( ( corner ) => 4 * k + corner ) );
		normals.forEach( ( normal, k ) => {

			for ( const [ x, y ] of [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 0, 1 ] ] ) {

				const place = [ k % cells + x, Math.floor( k / cells ) + y ].map( ( at ) => camera.orthoRight * ( 2 * at / cells - 1 ) );
				const position = right.scale( place[ 0 ] ).add( up.scale( place[ 1 ] ) );
				data.positions.push( ...position.asArray() );
				data.normals.push( ...normal );
				along.push( ...tangents[ k ], 1 );
				coordinates.push( ...directions[ k ].map( ( direction ) => BABYLON.Vector3.Dot( position, BABYLON.Vector3.FromArray( direction ) ) ) );

			}

		} );
		Object.assign( data, look === 'look-ups by uv' ? { uvs: coordinates } : { tangents: along } );
		const mesh = new BABYLON.Mesh( 'facets', scene );
		data.applyToMesh( mesh );
		mesh.material = material;
		material.backFaceCulling = false;
		target.renderList = [ mesh ];
		await scene.whenReadyAsync();
		while ( ! target.isReadyForRendering() ) await new Promise( ( done ) => setTimeout( done, 10 ) );
		scene.incrementRenderId();
		target.render();
		const pixels = await target.readPixels();
		normals.forEach( ( _, k ) => {

			const at = 8 * ( Math.floor( k / cells ) * size + k % cells );
			found.push( [ ...pixels.slice( at, at + 3 ) ] );

		} );
		mesh.dispose();

	}

	target.dispose();
	return found;

}

// --- The comparisons ---------------------------------------------------------------------------------------

const { EXRLoader } = await load( 'three/examples/jsm/loaders/EXRLoader.js' );
const { FloatType } = await load( 'three/build/three.core.js' );
const picture = ( file ) => new EXRLoader().setDataType( FloatType ).parse( Uint8Array.from( fs.readFileSync( file ) ).buffer );

/** The errors of which 95 and 99 of 100 colours stay below, in stops; 1 % of the mean radiance counts as black. */
function stops( found, wanted, black ) {

	const error = ( x, y ) => Math.abs( Math.log2( ( x + black ) / ( y + black ) ) );
	const errors = found.flatMap( ( rgb, k ) => rgb.map( ( x, c ) => error( x, wanted[ k ][ c ] ) ) ).sort( ( a, b ) => a - b );
	return [ 0.95, 0.99 ].map( ( share ) => errors[ Math.floor( share * errors.length ) ] );

}

const names = namesOf( folder );
const text = ( pair ) => pair.map( ( x ) => x.toFixed( 3 ) ).join( '/' );
const judged = ( text, isRight, rule ) => isRight ? text : `${text} WRONG: ${rule}`;
// `export-taps` takes other views: of some thousand colours, those beyond the last percent are few.
const near = ( found, noted ) => [ 0.02 + 0.2 * noted[ 0 ], 0.05 + 0.3 * noted[ 1 ] ].every( ( most, k ) => Math.abs( found[ k ] - noted[ k ] ) < most );
const log = fs.readFileSync( `${folder}/build.log`, 'utf8' );
const pairs = {};
for ( const name of names ) {

	const tensors = readTensors( `${folder}/out/numbers/${name}.safetensors` );
	const [ environment, material ] = name.split( '/' ), isCopper = material === 'copper';
	const points = pointsOf( picture( `${folder}/environments/${environment}.exr` ) );
	const black = 0.01 * points.reduce( ( sum, x, k ) => k % 6 < 3 ? sum : sum + x, 0 ) / ( 12 * Math.PI );
	const [ , ...noted ] = log.match( new RegExp( `numbers \\[${material}, ${environment}.*95 % of views are within (.*) stops, 99 % within ([0-9.]*[0-9])` ) );
	const lights = Float64Array.from( tensors.lights.data.filter( ( _, k ) => k % 7 !== 3 ) ); // without their radii
	const formulas = { copper: reflected, brushed: reflectedByBrushed };
	const under = ( points ) => formulas[ material ] && facets.map( ( facet ) => formulas[ material ]( facet, points ) );
	pairs[ name ] = {
		black,
		noted: noted.map( Number ),
		truth: under( points ),
		lights: under( lights ),
		lookUps: facets.map( formula( tensors ) ),
		isCopper,
	};

}

const { browser, address, close } = await openBrowser( folder, chromium );

/** A page that has drawn its pictures. */
async function opened( html ) {

	const page = await browser.newPage();
	page.on( 'pageerror', ( error ) => console.error( html, error ) );
	page.on( 'requestfailed', ( request ) => console.error( html, request.url(), request.failure().errorText ) );
	await page.setViewport( { width: 600, height: 400 } );
	await page.bringToFront();
	await page.goto( `${address}/${html}?size=64&names=${names}` );
	// A look every half second: a page in software does not always come to its next frame, at which it is looked by default.
	await page.waitForFunction( 'window.page', { timeout: 180000, polling: 500 } );
	return page;

}

/** Opens a page and compares what it draws; `frame` is what of Specula's frame the axes of the engine are. */
async function compare( html, draw, frame ) {

	const page = await opened( html );
	await page.screenshot( { path: `${folder}/${html}.png`, fullPage: true } );
	const reader = await page.evaluate( 'window.page.reader' );
	const brightest = await page.evaluate( 'window.page.brightest ?? Infinity' );
	const turned = ( v ) => frame.map( ( axis ) => dot( axis, v ) );
	// In the plane of the view the tangent of facet k, less a part along its normal, and what lies across that, on one side
	// or, as if a picture were mirrored, on the other.
	const directions = ( view, normal, tangent, k ) => {

		const along = add( tangent, times( - dot( tangent, view ) / dot( normal, view ), normal ) );
		return [ along, times( k % 2 ? 1 : - 1, cross( view, along ) ) ];

	};

	const asked = views.map( ( { view, normals, tangents } ) => ( {
		view: turned( view ), normals: normals.map( turned ), tangents: tangents.map( turned ),
		directions: normals.map( ( normal, k ) => directions( view, normal, tangents[ k ], k ).map( turned ) ),
	} ) );
	for ( const name of names ) {

		const seen = ( look, views = asked ) => page.evaluate( draw, { name, look, views } );
		const { black, noted, truth, lights, lookUps, isCopper } = pairs[ name ];
		const found = await seen( 'look-ups' );
		said( reader, `${name}: taps`, compared( found, lookUps, brightest ) );
		if ( ! isCopper ) said( reader, `${name}: taps by uv`, compared( await seen( 'look-ups by uv' ), lookUps, brightest ) );
		if ( ! truth ) continue;

		const errors = ( colours, model ) => stops( colours, truth.map( ( sums ) => sums[ model ] ), black );
		const whole = errors( found.map( ( rgb, k ) => add( rgb, lights[ k ].standard ) ), 'standard' );
		const asNoted = `${text( whole )} stops (noted ${noted.join( '/' )})`;
		if ( ! isCopper ) {

			said( reader, `${name}: ggx`, judged( asNoted, near( whole, noted ), 'not near the note' ) );
			continue;

		}

		const [ compact, own ] = [ await seen( 'compact' ), await seen( 'own' ) ], itself = errors( own, 'standard' );
		said( reader, `${name}: standard`, judged( `${asNoted}, without taps ${text( itself )}`,
			near( whole, noted ) && whole[ 0 ] < itself[ 0 ] / 2, 'not near the note, or not half' ) );

		const beside = stops( compact.map( ( rgb, k ) => add( rgb, times( - 1, found[ k ] ) ) ), lights.map( ( { engine } ) => engine ), black );
		const [ drawn, without ] = [ errors( compact, 'engine' ), errors( own, 'engine' ) ];
		said( reader, `${name}: own lights`, judged( `${text( drawn )} stops (its lights ${text( beside )}), without taps ${text( without )}`,
			beside[ 1 ] < 0.05 && drawn[ 0 ] < without[ 0 ] / 2, 'lights are elsewhere, or not half' ) );

	}

	// The page's own brute force, toward some of the views.
	const name = names.find( ( name ) => pairs[ name ].isCopper );
	if ( await page.evaluate( ( name ) => 'bruteForce' in window.page.looks[ name ], name ) ) {

		const { black } = pairs[ name ], some = views.length / 4;
		const points = pointsOf( picture( `${folder}/small/${name.split( '/' )[ 0 ]}.exr` ), 0 );
		const found = await page.evaluate( draw, { name, look: 'bruteForce', views: asked.slice( 0, some ) } );
		const errors = stops( found, facets.slice( 0, found.length ).map( ( facet ) => reflected( facet, points ).engine ), black );
		said( reader, `${name}: brute force`, judged( `${text( errors )} stops from the sum in numbers`, errors[ 1 ] < 0.02, 'more than 0.02' ) );

	}

	await page.close();

}

try {

	await compare( 'three.html', drawThree, [ [ 1, 0, 0 ], [ 0, 0, 1 ], [ 0, - 1, 0 ] ] );
	await compare( 'babylon.html', drawBabylon, [ [ 0, - 1, 0 ], [ 0, 0, 1 ], [ 1, 0, 0 ] ] );

} finally {

	await close();

}
