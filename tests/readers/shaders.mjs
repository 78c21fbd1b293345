// Runs the look-ups of engines that are not here: node shaders.mjs FOLDER CHROMIUM. Each text that
// `export-taps` writes is compiled (Filament's by matc as a whole, too; HLSL and GLSL by glslangValidator,
// then by naga into WGSL), and its function `tap_reflected` runs in WebGPU, on the textures of that engine,
// for the facets of formula.mjs. Directions are turned into the engine's world as its README.txt says of
// lights.

import { execFileSync } from 'child_process';
import fs from 'fs';
import path from 'path';
import { createRequire } from 'module';
import { pathToFileURL } from 'url';
import { openBrowser } from './browser.mjs';
import { compared, facets, formula, halves, namesOf, readTensors, rgb9e5 } from './formula.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const load = ( file ) => import( pathToFileURL( path.resolve( file ) ) );
const said = ( reader, file, text ) => console.log( `${reader}\t${file}\t${text}` );
const names = namesOf( folder ).filter( ( name ) => name.startsWith( 'studio/' ) ); // photographs are for taps.mjs
let name; // of the pair that is compared
const file = ( engine, file ) => `${folder}/out/${engine}/${name}/${file}`;
const read = ( ...names ) => fs.readFileSync( file( ...names ), 'utf8' );
// What a look-up takes: the tangent, too, if the material depends on it.
const isTurned = () => ! name.endsWith( 'copper' );
const taken = ( N, T, V ) => ( isTurned() ? [ N, T, V ] : [ N, V ] ).join( ', ' );
const between = ( text, begin, end ) => { const [ , rest ] = text.split( begin ); return rest.split( end )[ 0 ]; };

// --- From each text to WGSL with the names tap_levels, tap_normals, tap_table, tap_sampler, facets and found 

const MAIN = {
	wgsl: () => `
@group(0) @binding(3) var<storage, read> facets: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> found: array<vec4f>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    found[id.x] = vec4f(tap_reflected(${taken( 'facets[3u * id.x].xyz', 'facets[3u * id.x + 1u].xyz', 'facets[3u * id.x + 2u].xyz' )}), 1.0);
}`,
	glsl: () => `
layout(local_size_x = 64) in;
layout(set = 0, binding = 3) readonly buffer Facets { vec4 facets[]; };
layout(set = 0, binding = 4) buffer Found { vec4 found[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    found[i] = vec4(tap_reflected(${taken( 'facets[3u * i].xyz', 'facets[3u * i + 1u].xyz', 'facets[3u * i + 2u].xyz' )}), 1.0);
}`,
	hlsl: () => `
[[vk::binding(3)]] StructuredBuffer<float4> facets;
[[vk::binding(4)]] RWStructuredBuffer<float4> found;
[numthreads(64, 1, 1)] void main(uint3 id : SV_DispatchThreadID) {
    found[id.x] = float4(reflected(facets[3 * id.x].xyz, facets[3 * id.x + 1].xyz, facets[3 * id.x + 2].xyz), 1.0);
}`,
};

// GLSL for Vulkan: textures apart from their sampler, as WGSL has them.
const glsl = ( functions ) => `#version 450
layout(set = 0, binding = 0) uniform texture2D tap_levels;
layout(set = 0, binding = 1) uniform texture2D tap_normals;
layout(set = 0, binding = 2) uniform texture2D tap_table;
layout(set = 0, binding = 5) uniform sampler tap_sampler;
#define textureLod(picture, place, mip) textureLod(sampler2D(picture, tap_sampler), place, mip)
${functions}${MAIN.glsl()}`;

const hlsl = ( names, text, call ) => {

	const declared = names.map( ( name, binding ) => `[[vk::binding(${binding})]] Texture2D ${name};\n` ).join( '' );
	return `${declared}${text}\nfloat3 reflected(float3 N, float3 T, float3 V) {\n${call}\n}\n${MAIN.hlsl()}`;

};

const ENGINES = {
	Filament: {
		folder: 'filament', rounding: halves, language: 'glsl',
		text: () => glsl( between( read( 'filament', 'taps.mat' ), 'tapTable\n', 'void material(' ) ),
	},
	Godot: {
		folder: 'godot', rounding: halves, language: 'glsl',
		text: () => glsl( between( read( 'godot', 'taps.gdshader' ), '= 1.0;\n', 'void fragment()' ) ),
	},
	Unity: {
		folder: 'unity', rounding: halves, language: 'hlsl', fromBottom: true,
		text: () => hlsl( [ 'tap_levels', 'tap_normals', 'tap_table' ],
			read( 'unity', 'taps.hlsl' ).replace( /^Texture2D .*;$/gm, '' ).replace( 'SamplerState', '[[vk::binding(5)]] SamplerState' ),
			`float3 radiance; TapReflected_float(${taken( 'N', 'T', 'V' )}, radiance); return radiance;` ),
	},
	Unreal: {
		folder: 'unreal', rounding: halves, language: 'hlsl',
		text: () => hlsl( [ 'Levels', 'Normals', 'Table' ],
			read( 'unreal', 'taps.ush' ).replace( '#pragma once', '[[vk::binding(5)]] SamplerState LevelsSampler;' ),
			'FSpeculaTaps Taps;' + between( read( 'unreal', 'README.txt' ), 'FSpeculaTaps Taps;', '\n\n' ) ),
	},
	Bevy: {
		folder: 'bevy', cubes: true, rounding: rgb9e5, language: 'wgsl',
		text: () => ( '@group' + between( read( 'bevy', 'taps.wgsl' ).replace( '@group', 'BEGIN' ), 'BEGIN', '// Candelas' ) )
			.replaceAll( '#{MATERIAL_BIND_GROUP}', '0' )
			.replace( /binding\(10(.)\)/g, ( _, binding ) => `binding(${[ 0, 5, 1, 2 ][ binding ]})` ) + MAIN.wgsl(),
	},
};

const run = ( program, ...given ) => execFileSync( program, given, { stdio: 'pipe' } );

function wgsl( { folder: engine, language, text } ) {

	if ( language === 'wgsl' ) return text();
	const at = ( ending ) => file( engine, 'compute' + ending );
	fs.writeFileSync( at( '.comp' ), text() );
	const options = [ ...( language === 'hlsl' ? [ '-D' ] : [] ), '-V', '-S', 'comp', '-e', 'main', '--target-env', 'vulkan1.1' ];
	run( 'glslangValidator', ...options, at( '.comp' ), '-o', at( '.spv' ) );
	run( 'naga', at( '.spv' ), at( '.wgsl' ) );
	return fs.readFileSync( at( '.wgsl' ), 'utf8' );

}

// --- Textures ----------------------------------------------------------------------------------------------

const { EXRLoader } = await load( 'node_modules/three/examples/jsm/loaders/EXRLoader.js' );
const { HalfFloatType } = await load( 'node_modules/three/build/three.core.js' );
const ktx = await load( createRequire( path.resolve( 'package.json' ) ).resolve( 'ktx-parse' ) );
const { ZSTDDecoder } = await load( 'node_modules/three/examples/jsm/libs/zstddec.module.js' );
const zstd = new ZSTDDecoder();
await zstd.init();
const base64 = ( data ) => Buffer.from( data.buffer, data.byteOffset, data.byteLength ).toString( 'base64' );

/** What a texture of WebGPU is made of: the texels of each mip, with all layers. */
function texture( engine, stem, fromBottom ) {

	if ( fs.existsSync( file( engine, stem + '.exr' ) ) ) {

		const { buffer } = Uint8Array.from( fs.readFileSync( file( engine, stem + '.exr' ) ) );
		const { data, width, height } = new EXRLoader().setDataType( HalfFloatType ).parse( buffer );
		// three.js's loader has the rows from the bottom.
		const rows = Array.from( { length: height }, ( _, row ) => data.subarray( 4 * width * row, 4 * width * ( row + 1 ) ) );
		const texels = new Uint16Array( data.length );
		( fromBottom ? rows : rows.reverse() ).forEach( ( row, k ) => texels.set( row, 4 * width * k ) );
		return { format: 'rgba16float', bytes: 8, width, height, layers: 1, mips: [ base64( texels ) ] };

	}

	const found = ktx.read( fs.readFileSync( file( engine, stem + '.ktx2' ) ) );
	const isPacked = found.supercompressionScheme === 2;
	const level = ( { levelData, uncompressedByteLength } ) => isPacked ? zstd.decode( levelData, uncompressedByteLength ) : levelData;
	return {
		...( found.vkFormat === 123 ? { format: 'rgb9e5ufloat', bytes: 4 } : { format: 'rgba16float', bytes: 8 } ),
		width: found.pixelWidth, height: found.pixelHeight, layers: Math.max( found.layerCount, 1 ) * found.faceCount,
		mips: found.levels.map( ( mip ) => base64( level( mip ) ) ),
	};

}

// --- In the page -------------------------------------------------------------------------------------------

async function compute( { code, textures, facets } ) {

	const device = await ( await navigator.gpu.requestAdapter() ).requestDevice();
	const module = device.createShaderModule( { code } );
	const { messages } = await module.getCompilationInfo();
	const errors = messages.filter( ( { type } ) => type === 'error' ).map( ( { lineNum, message } ) => `${lineNum}: ${message}` );
	if ( errors.length ) throw new Error( errors.join( '; ' ) );
	const pipeline = await device.createComputePipelineAsync( { layout: 'auto', compute: { module, entryPoint: 'main' } } );
	const views = textures.map( ( { format, bytes, width, height, layers, mips } ) => {

		const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
		const texture = device.createTexture( { format, size: [ width, height, layers ], mipLevelCount: mips.length, usage } );
		mips.forEach( ( text, mipLevel ) => {

			const [ columns, rows ] = [ width, height ].map( ( length ) => Math.max( length >> mipLevel, 1 ) );
			const data = Uint8Array.from( atob( text ), ( character ) => character.charCodeAt() );
			const layout = { bytesPerRow: bytes * columns, rowsPerImage: rows };
			device.queue.writeTexture( { texture, mipLevel }, data, layout, [ columns, rows, layers ] );

		} );
		return texture.createView( { dimension: layers > 1 ? 'cube-array' : '2d' } );

	} );
	const sampler = device.createSampler( { magFilter: 'linear', minFilter: 'linear', mipmapFilter: 'linear' } );
	const given = Float32Array.from( facets.flatMap( ( { normal, tangent, view } ) => [ normal, tangent, view ].flatMap( ( v ) => [ ...v, 0 ] ) ) );
	const size = 16 * facets.length;
	const buffer = ( size, usage ) => device.createBuffer( { size, usage } );
	const [ input, output, back ] = [
		buffer( 3 * size, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST ),
		buffer( size, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC ),
		buffer( size, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST ),
	];
	device.queue.writeBuffer( input, 0, given );
	const resources = [ ...views, { buffer: input }, { buffer: output }, sampler ];
	const entries = resources.map( ( resource, binding ) => ( { binding, resource } ) );
	const group = device.createBindGroup( { layout: pipeline.getBindGroupLayout( 0 ), entries } );
	const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
	pass.setPipeline( pipeline );
	pass.setBindGroup( 0, group );
	pass.dispatchWorkgroups( facets.length / 64 );
	pass.end();
	encoder.copyBufferToBuffer( output, 0, back, 0, size );
	device.queue.submit( [ encoder.finish() ] );
	await back.mapAsync( GPUMapMode.READ );
	const found = new Float32Array( back.getMappedRange() );
	return facets.map( ( _, k ) => [ ...found.subarray( 4 * k, 4 * k + 3 ) ] );

}

// --- The comparisons ---------------------------------------------------------------------------------------

function compile() {

	try {

		run( 'matc', '--api', 'all', '--output', file( 'filament', 'taps.filamat' ), file( 'filament', 'taps.mat' ) );
		said( 'matc', `${name}: taps.mat`, 'compiles' );

	} catch ( error ) {

		said( 'matc', `${name}: taps.mat`, error.code === 'ENOENT' ? 'SKIPPED not installed' : `WRONG: ${error.stderr}`.replace( /\s+/g, ' ' ) );

	}

}

const { browser, address, close } = await openBrowser( folder, chromium );
try {

	const page = await browser.newPage();
	await page.goto( `${address}/blank.html` );
	for ( name of names ) {

		compile();
		const tensors = readTensors( `${folder}/out/numbers/${name}.safetensors` );
		for ( const [ engine, facts ] of Object.entries( ENGINES ) ) {

			try {

				const textures = [ 'levels', 'normals', 'table' ].map( ( stem ) => texture( facts.folder, stem, facts.fromBottom ) );
				// (y, z, x): the axes of the engine.
				const [ , axes ] = read( facts.folder, 'README.txt' ).replace( /\s+/g, ' ' ).match( /direction \(x, y, z\) is \(([^)]*)\)/ );
				const turned = ( v ) => axes.split( ', ' ).map( ( axis ) => ( axis[ 0 ] === '-' ? - 1 : 1 ) * v[ 'xyz'.indexOf( axis.at( - 1 ) ) ] );
				const asked = facets.map( ( { normal, tangent, view } ) => ( { normal: turned( normal ), tangent: turned( tangent ), view: turned( view ) } ) );
				const found = await page.evaluate( compute, { code: wgsl( facts ), textures, facets: asked } );
				const lookUps = facets.map( formula( tensors, facts.rounding ) );
				// SwiftShader has no neighbours beyond the edges of an array of cubes.
				const kept = lookUps.map( ( { crosses } ) => ! ( facts.cubes && crosses ) );
				const text = compared( ...[ found, lookUps ].map( ( list ) => list.filter( ( _, k ) => kept[ k ] ) ) );
				said( engine, `${name}: taps`, facts.cubes ? `${text}, without the edges of cubes` : text );

			} catch ( error ) {

				said( engine, `${name}: taps`, `WRONG: ${error.stderr || ''}${error.stdout || error}`.replace( /\s+/g, ' ' ) );

			}

		}

	}

} finally {

	await close();

}
