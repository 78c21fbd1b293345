// Compact reflection maps in three.js, WebGL 2. The text was written by Specula for one light and one material.

import * as THREE from 'three';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';

const lookUp = /* glsl */ `
uniform highp sampler2D tap_levels;
uniform highp sampler2D tap_normals;
uniform highp sampler2D tap_table;

__FUNCTIONS____TANGENT__
__MESH_TANGENT____END__`;

/** Loads the three pictures from a folder, whose name ends with a slash. */
export async function loadTaps( renderer, folder = '' ) {

	const loader = new KTX2Loader().setPath( folder ).detectSupport( renderer );
	const names = [ '__LEVELS__', '__NORMALS__', '__TABLE__' ];
	const [ levels, normals, table ] = await Promise.all( names.map( ( name ) => loader.loadAsync( name ) ) );
	const sampled = { minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, needsUpdate: true };
	for ( const texture of [ levels, normals, table ] ) Object.assign( texture, sampled );
	return { levels, normals, table };

}

/**
 * Makes a MeshStandardMaterial or MeshPhysicalMaterial reflect the light of the taps, in place of environment and
 * light maps. Lights of the scene are reflected as before.
 */
export function useTaps( material, { levels, normals, table } ) {

	material.onBeforeCompile = ( shader ) => {

		shader.uniforms.tap_levels = { value: levels };
		shader.uniforms.tap_normals = { value: normals };
		shader.uniforms.tap_table = { value: table };
__TANGENT__		// The tangent is moved as the normal is. Without the attribute it is zero.
		shader.vertexShader = `
#ifndef USE_TANGENT
	#define USE_TANGENT
	attribute vec4 tangent;
#endif
varying vec3 tap_mesh_tangent;
varying vec2 tap_uv;
` + shader.vertexShader
			.replace( '#include <normal_vertex>', '#include <normal_vertex>\n\ttap_mesh_tangent = transformedTangent;\n\ttap_uv = uv;' );
__END__		shader.fragmentShader = shader.fragmentShader
			.replace( '#include <common>', '#include <common>\n' + lookUp )
			.replace( '#include <lights_fragment_maps>', '' )
			.replace( '#include <lights_fragment_end>', `#include <lights_fragment_end>
	mat3 toWorld = transpose( mat3( viewMatrix ) );
	reflectedLight.indirectSpecular += tap_reflected( normalize( toWorld * geometryNormal ), __TANGENT__toWorld * tap_tangent( - vViewPosition ), __END__toWorld * geometryViewDir );` );

	};

	material.customProgramCacheKey = () => lookUp;
	material.needsUpdate = true;

}

/** The lights beside the levels, `lights` of __LIGHTS__, as lights of three.js. */
export function tapLights( lights ) {

	return lights.map( ( { direction: [ x, y, z ], irradiance } ) => {

		const light = new THREE.DirectionalLight( new THREE.Color( ...irradiance ) );
		light.position.set( x, z, - y );
		return light;

	} );

}
