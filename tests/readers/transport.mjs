// Whether relight.js and relight.wgsl, which `export-probes` writes with preset = "transport", light probes as `light-probes` does:
// node transport.mjs FOLDER CHROMIUM, in the folder of node_modules; FOLDER/out has what probes.toml makes. The JavaScript runs
// here, the WGSL in the browser. What a white matte surface reflects is compared in six directions, probe by probe, with the
// coefficients in a glTF file; with cpca, with the matrices of the file, summed as README.txt says, times the sky. Prints lines
// as readers.mjs does: the largest error, in shares of the brightest colour.

import fs from 'fs';
import path from 'path';
import { pathToFileURL } from 'url';
import { openBrowser } from './browser.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const MOST = 1e-3;
const axes = [ 0, 1, 2 ];

/** The nine coefficients of each probe in Specula's frame, x fastest, and the number of probes along each axis. */
function rowsOf( file ) {

	const bytes = fs.readFileSync( file ), length = bytes.readUInt32LE( 12 );
	const json = JSON.parse( bytes.subarray( 20, 20 + length ) ), begin = 28 + length;
	const { primitives, extras } = json.meshes[ 0 ];
	const numbers = ( name ) => {

		const { bufferView, count } = json.accessors[ primitives[ 0 ].attributes[ name ] ];
		const at = begin + json.bufferViews[ bufferView ].byteOffset;
		return Array.from( { length: count }, ( _, k ) => axes.map( ( c ) => bytes.readFloatLE( at + 4 * ( 3 * k + c ) ) ) );

	};

	const names = [ [ 0, 0 ], [ 1, 0 ], [ 1, 1 ], [ 1, 2 ], [ 2, 0 ], [ 2, 1 ], [ 2, 2 ], [ 2, 3 ], [ 2, 4 ] ];
	const rows = names.map( ( [ l, n ] ) => numbers( `_SH_DEGREE_${l}_COEF_${n}` ) );
	return { counts: extras.counts, rows: rows[ 0 ].map( ( _, probe ) => rows.map( ( row ) => row[ probe ] ) ) };

}

/** What a white matte surface reflects of nine rows, [ r, g, b ] each, toward a normal of the same axes. */
function reflected( rows, [ x, y, z ] ) {

	const pi = Math.PI, a = Math.sqrt( 1 / pi ) / 2, b = Math.sqrt( 3 / pi ) / 3, c = Math.sqrt( 15 / pi ) / 8, d = Math.sqrt( 5 / pi ) / 16;
	const basis = [ a, b * y, b * z, b * x, c * x * y, c * y * z, d * ( 3 * z * z - 1 ), c * x * z, c * ( x * x - y * y ) / 2 ];
	return axes.map( ( channel ) => basis.reduce( ( sum, y, k ) => sum + y * rows[ k ][ channel ], 0 ) );

}

/** The light of probes whose matrices are sums of those of clusters, as README.txt has it. */
function summed( { probes, sky: { columns, channels, offset, cpca } }, bytes, sky ) {

	const half = ( at ) => {

		const bits = bytes.readUInt16LE( at ), exponent = bits >> 10 & 31, fraction = bits & 1023;
		const size = exponent ? ( 1 + fraction / 1024 ) * 2 ** ( exponent - 15 ) : fraction * 2 ** - 24;
		return bits & 0x8000 ? - size : size;

	};

	const { components, weights, cluster_of: clusters } = cpca, length = 9 * columns * channels;
	const light = new Float64Array( 27 * probes );
	for ( let probe = 0; probe < probes; probe ++ ) {

		const first = offset + 2 * length * ( 1 + components ) * bytes[ clusters + probe ];
		const factors = Array.from( { length: components }, ( _, k ) => half( weights + 2 * ( components * probe + k ) ) );
		for ( let k = 0; k < length; k ++ ) {

			const number = factors.reduce( ( sum, factor, at ) => sum + factor * half( first + 2 * ( length * ( 1 + at ) + k ) ), half( first + 2 * k ) );
			const row = Math.floor( k / columns / channels ), column = Math.floor( k / channels ) % columns;
			for ( const c of channels === 1 ? axes : [ k % 3 ] ) light[ 27 * probe + 3 * row + c ] += number * sky[ column ][ c ];

		}

	}

	return light;

}

/** The largest difference of two lights, in shares of the brightest number. */
function apart( one, other ) {

	let worst = 0, brightest = 0;
	one.forEach( ( x, k ) => { worst = Math.max( worst, Math.abs( x - other[ k ] ) ); brightest = Math.max( brightest, Math.abs( other[ k ] ) ); } );
	return worst / brightest;

}

/** The largest error of the light of a file's probes, in shares of the brightest colour. */
function compared( light, { counts: [ nx, ny, nz ], rows } ) {

	let worst = 0, brightest = 0;
	for ( let probe = 0; probe < nx * ny * nz; probe ++ ) {

		// x of files is y of Specula, y is z and z is x.
		const [ y, z, x ] = [ probe % ny, Math.floor( probe / ny ) % nz, Math.floor( probe / ny / nz ) ];
		const own = Array.from( { length: 9 }, ( _, row ) => axes.map( ( c ) => light[ 27 * probe + 3 * row + c ] ) );
		const expected = rows[ ( z * ny + y ) * nx + x ];
		for ( const n of [ [ 1, 0, 0 ], [ 0, 1, 0 ], [ 0, 0, 1 ], [ - 0.6, 0.8, 0 ], [ 0, - 0.6, - 0.8 ], [ - 0.48, - 0.64, 0.6 ] ] ) {

			const wanted = reflected( expected, n ), found = reflected( own, [ n[ 1 ], n[ 2 ], n[ 0 ] ] );
			axes.forEach( ( c ) => { worst = Math.max( worst, Math.abs( found[ c ] - wanted[ c ] ) ); brightest = Math.max( brightest, wanted[ c ] ); } );

		}

	}

	return worst / brightest;

}

/** Lights probes on the graphics device of a page, in which this runs. */
async function lightOnDevice( { file, bytes, code, sky } ) {

	const adapter = await navigator.gpu?.requestAdapter();
	if ( ! adapter ) return null;
	const device = await adapter.requestDevice();
	const module = device.createShaderModule( { code } );
	const filled = ( data, usage ) => {

		const buffer = device.createBuffer( { size: Math.max( data.byteLength, 16 ), usage: usage | GPUBufferUsage.COPY_DST } );
		device.queue.writeBuffer( buffer, 0, data );
		return buffer;

	};

	const { STORAGE, UNIFORM, COPY_SRC, MAP_READ, COPY_DST } = GPUBufferUsage;
	const halves = filled( Uint8Array.from( bytes ), STORAGE );
	const colours = filled( new Float32Array( sky.slice( 0, file.sky.columns ).flatMap( ( rgb ) => [ ...rgb, 0 ] ) ), STORAGE );
	const light = filled( new Float32Array( 27 * file.probes ), STORAGE | COPY_SRC );
	const { columns, channels, offset, cpca } = file.sky;
	const encoder = device.createCommandEncoder();
	const run = ( entryPoint, rows, bindings ) => {

		const pipeline = device.createComputePipeline( { layout: 'auto', compute: { module, entryPoint } } );
		const entries = Object.entries( bindings ).map( ( [ binding, buffer ] ) => ( { binding: Number( binding ), resource: { buffer } } ) );
		const pass = encoder.beginComputePass();
		pass.setPipeline( pipeline );
		pass.setBindGroup( 0, device.createBindGroup( { layout: pipeline.getBindGroupLayout( 0 ), entries } ) );
		pass.dispatchWorkgroups( Math.ceil( rows / 64 ) );
		pass.end();

	};

	const rows = 9 * ( cpca ? cpca.clusters * ( 1 + cpca.components ) : file.probes );
	const section = filled( new Uint32Array( [ rows, columns, channels, offset / 2 ] ), UNIFORM );
	const lit = cpca ? filled( new Float32Array( 3 * rows ), STORAGE ) : light;
	run( 'relight', rows, { 0: section, 1: halves, 2: colours, 3: lit } );
	if ( cpca ) {

		const blended = filled( new Uint32Array( [ 9 * file.probes, cpca.components, cpca.weights / 2, cpca.cluster_of ] ), UNIFORM );
		run( 'blend', 9 * file.probes, { 1: halves, 3: light, 4: blended, 5: lit } );

	}

	const result = device.createBuffer( { size: light.size, usage: MAP_READ | COPY_DST } );
	encoder.copyBufferToBuffer( light, 0, result, 0, light.size );
	device.queue.submit( [ encoder.finish() ] );
	await result.mapAsync( GPUMapMode.READ );
	return Array.from( new Float32Array( result.getMappedRange() ) );

}

const { browser, address, close } = await openBrowser( folder, chromium );
try {

	const page = await browser.newPage();
	page.on( 'pageerror', ( error ) => console.error( error ) );
	await page.goto( `${address}/blank.html` );
	const sky = JSON.parse( fs.readFileSync( `${folder}/out/sky.json` ) ).coefficients;
	const expected = rowsOf( `${folder}/out/lit/probes.glb` );
	for ( const name of [ 'plain', 'cpca' ] ) {

		const at = path.resolve( folder, 'out', name );
		const { ProbeTransport } = await import( pathToFileURL( `${at}/relight.js` ) );
		const file = JSON.parse( fs.readFileSync( `${at}/transport.json` ) ), bytes = fs.readFileSync( `${at}/transport.bin` );
		const transport = new ProbeTransport( file, new Uint8Array( bytes ).buffer );
		const times = Array.from( { length: 20 }, () => { const start = performance.now(); transport.light( sky ); return performance.now() - start; } );
		const { cpca } = file.sky, own = cpca && summed( file, bytes, sky );
		const error = ( light ) => cpca ? apart( light, own ) : compared( light, expected );
		const inJavaScript = error( transport.light( sky ) );
		const found = await page.evaluate( lightOnDevice, { file, bytes: Array.from( bytes ), code: fs.readFileSync( `${at}/relight.wgsl`, 'utf8' ), sky } );
		const onDevice = found && error( found );
		const isRight = inJavaScript < MOST && ( found === null || onDevice < MOST );
		const stored = cpca ? `, ${cpca.bytes.toFixed( 1 )} bytes a probe, ${compared( own, expected ).toExponential( 1 )} from light-probes` : '';
		const time = `${Math.min( ...times ).toFixed( 1 )} ms for ${file.probes} probes`;
		const device = found === null ? 'SKIPPED: no WebGPU' : onDevice.toExponential( 1 );
		console.log( `relight\tprobes/${name}\tJavaScript ${inJavaScript.toExponential( 1 )} in ${time}, WGSL ${device}${stored}${isRight ? '' : ' WRONG'}` );

	}

} finally {

	await close();

}
