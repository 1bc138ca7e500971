#!/bin/sh
# Downloads six free-running zigzags of KVLCC2 (HSVA, for the SIMMAN 2008 workshop) into this folder, 4.7 MB,
# checks them, and writes each as a CSV file with named columns. Run it again at any time.
set -eu
cd "$(dirname "$0")"

repository=martinlarsalbert/System-identification-of-Vessel-Manoeuvring-Models
commit=4b7ce53f0cc8ac159126fdda7d45e30c540be2d8
folder=data/01_raw/kvlcc2_hsva/raw_data
url=https://raw.githubusercontent.com/$repository/$commit/$folder

fail() {
    echo "fetch.sh: $1" >&2
    exit 1
}

sha256() {
    if command -v sha256sum >/dev/null; then sha256sum "$1"; else shasum -a 256 "$1"; fi | cut -d ' ' -f 1
}

while read -r run expected; do
    file=HSVA_CPMC_KVLCC2_Z_$run.dat
    if [ ! -f "$file" ]; then
        curl --fail --silent --show-error --location --output "$file.partial" "$url/$file" ||
            fail "cannot download $url/$file: check the connection, or open https://github.com/$repository, take $folder/$file of commit $commit by hand, put it into $PWD and run fetch.sh again"
        mv "$file.partial" "$file"
    fi
    [ "$(sha256 "$file")" = "$expected" ] ||
        fail "$PWD/$file is not the file that this example was made with (its SHA-256 differs from $expected): delete it and run fetch.sh again; if that does not help, the download is being altered on its way"

    # The files have no row of names. u and v of the repository are the slopes of x and y: velocities north and east.
    # Its column p is the rate of yaw, the slope of the heading; its column r is not used here.
    {
        echo "time [s],x [m],y [m],heading [deg],north [m/s],east [m/s],yaw rate [deg/s],unused,rudder [deg],propeller [rev/s],thrust [N],torque [N m]"
        LC_ALL=C awk -v OFS=, 'NF == 12 { $1 = $1; print }' "$file"
    } >"$run.csv"
done <<END
10_05 db2b9921264d4a2b998d259d001adb016c7368dd7ac1772dbeb96037875469b3
20_10_P 6df42ab1dd49d481ce28172234d114018c645e45abbf1bcd609c70292c77830a
30_05 799303a2e29b3e8aaa178adffdf1a0f0179483f2593f290c3110263e85bf4c3d
10_10_P fd3a1508e2c6f5fda46145a104c227789fbfa6a1847dd33723510872307467c4
20_10_S 5fdf062d6077f3ed7da1ef89354d335d3a4fb89f5be4b2c448d77490ee0f01f4
35_05 6c2be03f2d6cdaf512c191b232352d040e8d7e64c286a2d4cac2de293dcc4796
END
echo "fetch.sh: six zigzags are in $PWD"
