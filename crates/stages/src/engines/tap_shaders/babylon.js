// Compact reflection maps in Babylon.js, WebGL 2. The text was written by Specula for one light and one material.

import { Color3, DirectionalLight, MaterialPluginBase, Texture, Vector3 } from '@babylonjs/core';

const lookUp = /* glsl */ `
uniform highp sampler2D tap_levels;
uniform highp sampler2D tap_normals;
uniform highp sampler2D tap_table;

__FUNCTIONS__`;

/** Loads the three pictures from a folder, whose name ends with a slash. */
export async function loadTaps( scene, folder = '' ) {

	const load = ( name ) => new Promise( ( done, fail ) => {

		const options = { noMipmap: true, invertY: false, samplingMode: Texture.BILINEAR_SAMPLINGMODE };
		const texture = new Texture( folder + name, scene, { ...options, onLoad: () => done( texture ), onError: fail } );
		texture.wrapU = texture.wrapV = Texture.CLAMP_ADDRESSMODE;

	} );
	const [ levels, normals, table ] = await Promise.all( [ '__LEVELS__', '__NORMALS__', '__TABLE__' ].map( load ) );
	return { levels, normals, table };

}

/**
 * Makes a PBRMaterial reflect the light of the taps: `new Taps( material, await loadTaps( scene ) )`. The scene has no
 * environmentTexture, or the material's environmentIntensity is 0. Lights of the scene are reflected as before.
 */
export class Taps extends MaterialPluginBase {

	constructor( material, { levels, normals, table } ) {

		super( material, 'Taps', 200, {}, true, true );
		this.textures = { tap_levels: levels, tap_normals: normals, tap_table: table };

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

		return shaderType === 'fragment' ? {
			CUSTOM_FRAGMENT_DEFINITIONS: lookUp,
			CUSTOM_FRAGMENT_BEFORE_FOG: 'finalColor.rgb += tap_reflected(normalW, viewDirectionW);',
		} : null;

	}

}

/** The lights beside the levels, `lights` of __LIGHTS__, as lights of Babylon.js. */
export function tapLights( lights, scene ) {

	return lights.map( ( { direction: [ x, y, z ], irradiance }, index ) => {

		// A light shines along its direction, away from where it is.
		const light = new DirectionalLight( 'tap light ' + index, new Vector3( y, - z, - x ), scene );
		light.diffuse = light.specular = new Color3( ...irradiance );
		light.intensity = Math.PI; // Babylon.js divides by pi
		return light;

	} );

}
