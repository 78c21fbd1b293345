// Makes a light volume of VRC Light Volumes for each volume of Specula: menu Tools > Specula > Load Light Volumes.
// Put this file into a folder named Editor.

using System;
using System.IO;
using UnityEditor;
using UnityEngine;
using VRCLightVolumes;

public static class SpeculaLightVolumes
{
    [Serializable]
    class Volume
    {
        public string name;
        public int[] resolution;
        public float[] center;
        public float[] size;
        public int offset;
    }

    [Serializable]
    class VolumeFile
    {
        public string texels;
        public Volume[] volumes;
    }

    [MenuItem("Tools/Specula/Load Light Volumes")]
    static void Load()
    {
        string path = EditorUtility.OpenFilePanel("Light volumes of Specula", "Assets", "json");
        if (string.IsNullOrEmpty(path)) return;
        var file = JsonUtility.FromJson<VolumeFile>(File.ReadAllText(path));
        byte[] texels = File.ReadAllBytes(Path.Combine(Path.GetDirectoryName(path), file.texels));
        for (int index = 0; index < file.volumes.Length; index++) Make(file.volumes[index], texels, index);
        AssetDatabase.SaveAssets();
    }

    static void Make(Volume volume, byte[] texels, int index)
    {
        int[] size = volume.resolution;
        int length = 8 * size[0] * size[1] * size[2];
        var textures = new Texture3D[3];
        if (!AssetDatabase.IsValidFolder("Assets/SpeculaLightVolumes")) AssetDatabase.CreateFolder("Assets", "SpeculaLightVolumes");
        for (int part = 0; part < 3; part++)
        {
            var bytes = new byte[length];
            Buffer.BlockCopy(texels, volume.offset + part * length, bytes, 0, length);
            var texture = new Texture3D(size[0], size[1], size[2], TextureFormat.RGBAHalf, false)
            {
                wrapMode = TextureWrapMode.Clamp,
                filterMode = FilterMode.Bilinear,
            };
            texture.SetPixelData(bytes, 0);
            texture.Apply(false);
            AssetDatabase.CreateAsset(texture, "Assets/SpeculaLightVolumes/volume-" + index + "-" + part + ".asset");
            textures[part] = texture;
        }

        var place = new GameObject(volume.name);
        place.transform.position = new Vector3(volume.center[0], volume.center[1], volume.center[2]);
        place.transform.localScale = new Vector3(volume.size[0], volume.size[1], volume.size[2]);
        var light = place.AddComponent<LightVolume>();
        light.Bake = false;
        light.AdaptiveResolution = false;
        light.Resolution = new Vector3Int(size[0], size[1], size[2]);
        light.Texture0 = textures[0];
        light.Texture1 = textures[1];
        light.Texture2 = textures[2];
        EditorUtility.SetDirty(light);
    }
}
