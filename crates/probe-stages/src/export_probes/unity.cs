// Sets the light probes of the open scene from a file of Specula: menu Tools > Specula > Load Light Probes.
// Put this file into a folder named Editor.

using System;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

public static class SpeculaLightProbes
{
    [Serializable]
    class ProbeFile
    {
        public float[] positions;
        public float[] coefficients;
    }

    [MenuItem("Tools/Specula/Load Light Probes")]
    static void Load()
    {
        string path = EditorUtility.OpenFilePanel("Light probes of Specula", "Assets", "json");
        if (string.IsNullOrEmpty(path)) return;
        var file = JsonUtility.FromJson<ProbeFile>(System.IO.File.ReadAllText(path));
        int count = file.positions == null ? 0 : file.positions.Length / 3;
        if (count == 0 || file.coefficients == null || file.coefficients.Length != 27 * count)
        {
            Debug.LogError("SpeculaLightProbes: " + path + " has no light probes for Unity");
            return;
        }

        var positions = new Vector3[count];
        var light = new SphericalHarmonicsL2[count];
        for (int probe = 0; probe < count; probe++)
        {
            positions[probe] = new Vector3(file.positions[3 * probe], file.positions[3 * probe + 1], file.positions[3 * probe + 2]);
            for (int channel = 0; channel < 3; channel++)
                for (int row = 0; row < 9; row++)
                    light[probe][channel, row] = file.coefficients[27 * probe + 9 * channel + row];
        }

        LightProbes probes = LightmapSettings.lightProbes;
#if UNITY_2023_2_OR_NEWER
        if (probes != null && probes.SetPositionsSelf(positions, true))
        {
            probes.bakedProbes = light;
            LightProbes.Tetrahedralize();
            Done(probes, count);
            return;
        }
#endif
        if (probes == null || !SetByPlace(probes, positions, light))
        {
            var group = new GameObject("Light probes of Specula").AddComponent<LightProbeGroup>();
            group.probePositions = positions;
            Debug.Log("SpeculaLightProbes: added a LightProbeGroup with " + count + " places. Bake the lighting once, " +
                "with no other group in the scene, and load the file again.");
            return;
        }
        Done(probes, count);
    }

    // Gives each baked probe the light of the nearest place, if they stand where those of the file do.
    static bool SetByPlace(LightProbes probes, Vector3[] positions, SphericalHarmonicsL2[] light)
    {
        Vector3[] baked = probes.positions;
        var found = new SphericalHarmonicsL2[baked.Length];
        for (int probe = 0; probe < baked.Length; probe++)
        {
            int nearest = 0;
            for (int other = 1; other < positions.Length; other++)
                if ((positions[other] - baked[probe]).sqrMagnitude < (positions[nearest] - baked[probe]).sqrMagnitude) nearest = other;
            if ((positions[nearest] - baked[probe]).magnitude > 0.01f) return false;
            found[probe] = light[nearest];
        }
        probes.bakedProbes = found;
        return baked.Length > 0;
    }

    static void Done(LightProbes probes, int count)
    {
        EditorUtility.SetDirty(probes);
        SceneView.RepaintAll();
        Debug.Log("SpeculaLightProbes: set " + count + " light probes.");
    }
}
