# gnuplot -e "table='rod10_turning.csv'; plot_file='rod10_turning.svg'" plot.gp
set terminal svg size 640,440 font 'Helvetica,13' background rgb 'white'
set output plot_file
set datafile separator ','
set logscale xy
set format y '10^{%L}'
set xlabel 'time of a frame [us]'
set ylabel 'error of the deflection, relative'
set yrange [1e-11:100]
set grid
set key bottom left
plot for [n in '10 40 160'] table using (int($1) == int(n) ? $3 * 1e6 : 1/0):4 with linespoints title n.' nodes', \
    table using (int($1) == 10 ? $3 * 1e6 : 1/0):4:(sprintf('%d', $2)) with labels left offset 0.7,0.3 font ',10' title 'k'
