// Reads the files of run.sh with three.js, Babylon.js and ktx-parse, and prints a line for each.

import fs from 'fs';
import path from 'path';
import { createRequire } from 'module';
import { pathToFileURL } from 'url';

const folder = process.argv[ 2 ];
const require = createRequire( path.resolve( 'package.json' ) );
const load = ( name ) => import( pathToFileURL( path.resolve( 'node_modules', name ) ) );
const bytes = ( file ) => new Uint8Array( fs.readFileSync( `${folder}/${file}` ) );
const text = ( file ) => fs.readFileSync( `${folder}/${file}`, 'utf8' );
const floats = ( file ) => { const data = bytes( file ); return new Float32Array( data.buffer, data.byteOffset, data.length / 4 ); };
const said = ( reader, file, text ) => console.log( `${reader}\t${file}\t${text}` );
const HALF = 2 ** - 11;

// The largest error of a channel in relation to its pixel's largest. Readers that keep rows from the bottom say so.
function compare( reader, file, read, wanted, { most = 0, factor = 1, flipped = false, remark = '' } = {} ) {

	try {

		const { data, channels, width } = read( bytes( file ) );
		const pixels = wanted.length / 3, height = pixels / width;
		if ( data.length !== pixels * channels ) throw new Error( `${data.length} numbers` );
		let error = 0;
		for ( let pixel = 0; pixel < pixels; pixel ++ ) {

			const from = flipped ? ( height - 1 - Math.floor( pixel / width ) ) * width + pixel % width : pixel;
			const rgb = [ 0, 1, 2 ].map( ( c ) => wanted[ 3 * pixel + c ] );
			const largest = Math.max( ...rgb.map( Math.abs ), 1e-20 );
			rgb.forEach( ( value, c ) => { error = Math.max( error, Math.abs( data[ channels * from + c ] / factor - value ) / largest ); } );

		}

		said( reader, file, error.toExponential( 1 ) + ( error <= most ? remark : ` WRONG: more than ${most}` ) );

	} catch ( failure ) {

		said( reader, file, `WRONG: ${failure}` );

	}

}

const half = ( code ) => {

	const [ sign, exponent, fraction ] = [ code >> 15 ? - 1 : 1, code >> 10 & 31, code & 1023 ];
	return sign * ( exponent ? ( 1 + fraction / 1024 ) * 2 ** ( exponent - 15 ) : fraction * 2 ** - 24 );

};

for ( const version of [ 'three150', 'three170', 'three183', 'three' ] ) {

	const three = await load( `${version}/build/three.module.js` );
	const loader = async ( names ) => {

		for ( const name of names ) {

			const file = `${version}/examples/jsm/loaders/${name}.js`;
			if ( fs.existsSync( `node_modules/${file}` ) ) return ( await load( file ) )[ name ];

		}

	};

	const [ HDR, EXR ] = [ await loader( [ 'HDRLoader', 'RGBELoader' ] ), await loader( [ 'EXRLoader' ] ) ];
	const parse = ( Loader ) => ( data ) => {

		const instance = new Loader();
		instance.setDataType( three.FloatType );
		const found = instance.parse( data.buffer.slice( data.byteOffset, data.byteOffset + data.length ) );
		return { data: found.data, channels: 4, width: found.width };

	};

	const reader = `three r${three.REVISION}`;
	for ( const name of [ 'soft', 'dim', 'sun' ] ) {

		const wanted = floats( `${name}.f32` );
		compare( reader, `${name}/picture.hdr`, parse( HDR ), wanted, { factor: 256 / 255, most: 1e-6, remark: ' after its division by 255' } );
		compare( reader, `${name}/picture.exr`, parse( EXR ), wanted, { flipped: true } );
		compare( reader, `${name}/float.exr`, parse( EXR ), wanted, { flipped: true } );

	}

}

const hdr = await load( '@babylonjs/core/Misc/HighDynamicRange/hdr.js' );
for ( const name of [ 'soft', 'dim', 'sun' ] ) {

	const read = ( data ) => {

		const info = hdr.RGBE_ReadHeader( data );
		return { data: hdr.RGBE_ReadPixels( data, info ), channels: 3, width: info.width };

	};

	compare( 'Babylon.js', `${name}/picture.hdr`, read, floats( `${name}.f32` ) );

}

const { GetEnvInfo } = await load( '@babylonjs/core/Misc/environmentTextureTools.js' );
try {

	const data = bytes( 'out/babylon/environment.env' );
	const info = GetEnvInfo( data );
	const begins = info.specular.mipmaps.map( ( { position } ) => data.subarray( info.binaryDataPosition + position ).slice( 1, 4 ) );
	const right = info.width === 32 && begins.length === 36 && begins.every( ( begin ) => String.fromCharCode( ...begin ) === 'PNG' );
	said( 'Babylon.js', 'out/babylon/environment.env', right ? `${begins.length} images` : 'WRONG' );

} catch ( failure ) {

	said( 'Babylon.js', 'out/babylon/environment.env', `WRONG: ${failure}` );

}

// Lights as glTF, in the world of each engine after its loader.
{

	const { GLTFLoader } = await load( 'three/examples/jsm/loaders/GLTFLoader.js' );
	const { NullEngine, Scene, ImportMeshAsync } = await load( '@babylonjs/core/index.js' );
	await load( '@babylonjs/loaders/glTF/index.js' );
	const three = async ( document ) => {

		const { scene } = await new GLTFLoader().parseAsync( document, '' );
		scene.updateMatrixWorld( true );
		const found = [];
		scene.traverse( ( light ) => light.isDirectionalLight && found.push( light ) );
		return found.map( ( light ) => {

			const toward = light.getWorldPosition( light.position.clone() ).sub( light.target.getWorldPosition( light.position.clone() ) );
			return [ toward.normalize().toArray(), light.color.toArray().map( ( x ) => x * light.intensity ) ];

		} );

	};

	const babylon = async ( document ) => {

		const scene = new Scene( new NullEngine() );
		await ImportMeshAsync( `data:${document}`, scene, { pluginExtension: '.gltf' } );
		return scene.lights.map( ( light ) => {

			light.computeTransformedInformation();
			const color = light.diffuse.asArray().map( ( x ) => x * light.intensity );
			return [ light.transformedDirection.normalizeToNew().negate().asArray(), color ];

		} );

	};

	for ( const [ reader, engine, read ] of [ [ 'three.js', 'three', three ], [ 'Babylon.js', 'babylon', babylon ] ] ) {

		const file = `sun-light/${engine}/environment-lights.gltf`;
		try {

			const { lights } = JSON.parse( text( `sun-light/${engine}/environment-lights.json` ) );
			const found = await read( text( file ) );
			const numbers = found.flat( 2 ), wanted = lights.flatMap( ( { direction, colour, intensity } ) => [ ...direction, ...colour.map( ( x ) => x * intensity ) ] );
			const error = Math.max( ...numbers.map( ( x, k ) => Math.abs( x - wanted[ k ] ) / Math.max( 1, ...wanted.map( Math.abs ).slice( k - k % 3, k - k % 3 + 3 ) ) ) );
			said( reader, file, error.toExponential( 1 ) + ( numbers.length === wanted.length && error < 1e-5 ? '' : ' WRONG' ) );

		} catch ( failure ) {

			said( reader, file, `WRONG: ${failure}` );

		}

	}

}

const { DDSTools } = await load( '@babylonjs/core/Misc/dds.js' );
{

	const info = DDSTools.GetDDSInfo( bytes( 'out/babylon-floats/environment.dds' ) );
	const right = info.isCube && info.width === 32 && info.height === 32 && info.mipmapCount === 6 && info.dxgiFormat === 2;
	said( 'Babylon.js', 'out/babylon-floats/environment.dds', right ? 'header' : `WRONG: ${JSON.stringify( info )}` );

}

// What `ktx validate` checks, as far as ktx-parse shows it: sizes, order, alignment, and the descriptor of the texels.
const ktx = await import( pathToFileURL( require.resolve( 'ktx-parse' ) ) );
const { ZSTDDecoder } = await load( 'three/examples/jsm/libs/zstddec.module.js' );
const zstd = new ZSTDDecoder();
await zstd.init();
const compared = new Map( [ [ 'soft/picture.ktx2', 'soft.f32' ], [ 'sun/picture.ktx2', 'sun.f32' ], [ 'soft/cube.ktx2', 'soft/strip.f32' ], [ 'sun/cube.ktx2', 'sun/strip.f32' ], [ 'out/shrm-cubes.ktx2', 'out/shrm-cubes.f32' ] ] );
const written = fs.readdirSync( `${folder}/out`, { recursive: true } ).filter( ( file ) => file.endsWith( '.ktx2' ) ).map( ( file ) => `out/${file}` );
for ( const file of new Set( [ ...compared.keys(), ...written.sort() ] ) ) {

	const wanted = compared.get( file );
	try {

		const found = ktx.read( bytes( file ) );
		// The bytes of a block and the texels along its edge, and the bytes of a number.
		const [ block, edge, size ] = { 97: [ 8, 1, 2 ], 109: [ 16, 1, 4 ], 123: [ 4, 1, 4 ], 143: [ 16, 4, 1 ] }[ found.vkFormat ] ?? [];
		const [ descriptor ] = found.dataFormatDescriptor;
		const images = Math.max( found.layerCount, 1 ) * found.faceCount;
		const keys = Object.keys( found.keyValue );
		const levels = found.levels.map( ( level, index ) => {

			const [ columns, rows ] = [ found.pixelWidth, found.pixelHeight ].map( ( length ) => Math.ceil( Math.max( length >> index, 1 ) / edge ) );
			const data = found.supercompressionScheme === 2 ? zstd.decode( level.levelData, level.uncompressedByteLength ) : level.levelData;
			return data.length === columns * rows * images * block && level.uncompressedByteLength === data.length && data;

		} );
		const checks = {
			format: block !== undefined,
			typeSize: found.typeSize === size,
			'level sizes': levels.every( Boolean ),
			'cube faces are square': found.faceCount === 1 || found.pixelWidth === found.pixelHeight,
			'linear BT.709': descriptor.transferFunction === 1 && descriptor.colorPrimaries === 1,
			'bits of the samples': descriptor.samples.reduce( ( end, sample ) => Math.max( end, sample.bitOffset + sample.bitLength + 1 ), 0 ) === 8 * block,
			'keys are sorted': keys.every( ( key, index ) => index === 0 || keys[ index - 1 ] < key ),
			KTXwriter: /^specula/.test( found.keyValue.KTXwriter ),
			KTXorientation: /^rd/.test( found.keyValue.KTXorientation ),
		};
		const failed = Object.keys( checks ).filter( ( check ) => ! checks[ check ] );
		if ( failed.length ) throw new Error( failed.join( ', ' ) );
		if ( ! wanted || ! fs.existsSync( `${folder}/${wanted}` ) ) { said( 'ktx-parse', file, `sound, ${found.layerCount} layers, ${found.faceCount} faces, ${found.levels.length} levels` ); continue; }
		const data = levels[ 0 ].slice();
		const numbers = size === 4 ? new Float32Array( data.buffer ) : Float32Array.from( new Uint16Array( data.buffer ), half );
		compare( 'ktx-parse', file, () => ( { data: numbers, channels: 4, width: found.pixelWidth } ), floats( wanted ), { most: size === 4 ? 0 : HALF } );

	} catch ( failure ) {

		said( 'ktx-parse', file, `WRONG: ${failure}` );

	}

}
