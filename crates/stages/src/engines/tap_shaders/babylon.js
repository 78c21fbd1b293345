// Compact reflection maps in Babylon.js, WebGL 2. The text was written by Specula for one light and one material.

import { Color3, Constants, DirectionalLight, MaterialPluginBase, RawTexture, Texture, Vector3 } from '@babylonjs/core';

const lookUp = /* glsl */ `
uniform highp sampler2D tap_levels;
uniform highp sampler2D tap_normals;
uniform highp sampler2D tap_table;

__FUNCTIONS____TANGENT__
__MESH_TANGENT____END__`;

// Babylon.js takes shaders with equal defines for equal: this one differs with the constants of the text.
const define = [ 'TAPS', ...[ ...lookUp.matchAll( /const .* = (.*);/g ) ].map( ( [ , value ] ) => value ) ].join( '_' ).replace( /\W+/g, '_' );

/** Loads the three pictures, KTX2 of halves without compression, from a folder, whose name ends with a slash. */
export async function loadTaps( scene, folder = '' ) {

	const load = async ( name ) => {

		const file = await ( await fetch( folder + name ) ).arrayBuffer();
		const header = new DataView( file );
		const [ format, width, height ] = [ 12, 20, 24 ].map( ( at ) => header.getUint32( at, true ) );
		const [ start, length ] = [ 80, 88 ].map( ( at ) => Number( header.getBigUint64( at, true ) ) );
		if ( format !== 97 || length !== 8 * width * height ) throw new Error( name + ': not RGBA16F' );
		const texels = new Uint16Array( file.slice( start, start + length ) );
		const texture = RawTexture.CreateRGBATexture( texels, width, height, scene, false, false,
			Texture.BILINEAR_SAMPLINGMODE, Constants.TEXTURETYPE_HALF_FLOAT );
		texture.wrapU = texture.wrapV = Texture.CLAMP_ADDRESSMODE;
		return texture;

	};

	const [ levels, normals, table ] = await Promise.all( [ '__LEVELS__', '__NORMALS__', '__TABLE__' ].map( load ) );
	return { levels, normals, table };

}

/**
 * Makes a PBRMaterial reflect the light of the taps: `new Taps( material, await loadTaps( scene ) )`. The scene has no
 * environmentTexture, or the material's environmentIntensity is 0. Lights of the scene are reflected as before.
 */
export class Taps extends MaterialPluginBase {

	constructor( material, { levels, normals, table } ) {

		super( material, 'Taps', 200, { [ define ]: false }, true, true );
		this.textures = { tap_levels: levels, tap_normals: normals, tap_table: table };

	}

__TANGENT__	prepareDefinesBeforeAttributes( defines ) {

		defines._needUVs = true;

	}

__END__	prepareDefines( defines ) {

		defines[ define ] = true;

	}

	getClassName() {

		return 'Taps';

	}

	getSamplers( samplers ) {

		samplers.push( ...Object.keys( this.textures ) );

	}

	bindForSubMesh( uniformBuffer ) {

		for ( const [ name, texture ] of Object.entries( this.textures ) ) uniformBuffer.setTexture( name, texture );

	}

	getCustomCode( shaderType ) {

__TANGENT__		if ( shaderType === 'vertex' ) return {
			CUSTOM_VERTEX_DEFINITIONS: 'varying vec3 tap_mesh_tangent;\nvarying vec2 tap_uv;',
			CUSTOM_VERTEX_MAIN_END: `
#ifdef TANGENT
	tap_mesh_tangent = mat3(finalWorld) * tangentUpdated.xyz;
#else
	tap_mesh_tangent = vec3(0.0);
#endif
	tap_uv = uvUpdated;`,
		};
__END__		return shaderType === 'fragment' ? {
			CUSTOM_FRAGMENT_DEFINITIONS: lookUp,
			CUSTOM_FRAGMENT_BEFORE_FOG: 'finalColor.rgb += tap_reflected(normalW, __TANGENT__tap_tangent(vPositionW), __END__viewDirectionW);',
		} : null;

	}

}

/** The lights beside the levels, `lights` of __LIGHTS__, as lights of Babylon.js. */
export function tapLights( lights, scene ) {

	return lights.map( ( { direction: [ x, y, z ], irradiance }, index ) => {

		// A light shines along its direction, away from where it is.
		const light = new DirectionalLight( 'tap light ' + index, new Vector3( y, - z, - x ), scene );
		light.diffuse = light.specular = new Color3( ...irradiance );
		return light;

	} );

}
